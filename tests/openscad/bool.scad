difference(){ union(){ cube(10,center=true); translate([0,0,5]) cylinder(h=4,r=4);} sphere(6.2); for(a=[0:90:270]) rotate([0,0,a]) translate([4,4,-10]) cylinder(h=20,r=0.7,$fn=12);}
translate([20,0,0]) intersection(){ cube(8,center=true); sphere(5); rotate([45,0,0]) cube(7,center=true);}
translate([0,20,0]) mirror([1,0,0]) difference(){ cylinder(h=5,r1=5,r2=3); rotate([0,20,0]) cylinder(h=30,r=1.5,center=true); translate([2,0,0]) cube([9,1,20],center=true);}
