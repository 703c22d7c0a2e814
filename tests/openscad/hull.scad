hull(){ sphere(2); translate([8,0,0]) cube(3); translate([0,6,2]) cylinder(h=2,r=1);}
translate([20,0,0]) minkowski(){ cube([6,4,2]); sphere(1,$fn=12);}
translate([0,20,0]) minkowski(){ union(){ cube([6,2,2]); cube([2,6,2]);} cylinder(h=1,r=1,$fn=8); }
translate([20,20,0]) resize([6,0,9],auto=[false,true,false]) sphere(2);
translate([40,0,0]) minkowski(){ linear_extrude(2) polygon([[0,0],[8,0],[8,3],[3,3],[3,8],[0,8]]); sphere(0.7,$fn=8);}
translate([40,20,0]) hull(){ for(x=[0,8],y=[0,5]) translate([x,y,0]) cylinder(h=2,r=1.5); translate([4,2.5,5]) sphere(1);}
translate([60,0,0]) resize([10,10,10]) difference(){ cube(4); translate([1,1,-1]) cube([2,2,9]); }
