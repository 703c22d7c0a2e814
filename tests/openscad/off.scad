linear_extrude(2) offset(r=1.5) polygon([[0,0],[10,0],[10,4],[4,4],[4,10],[0,10]]);
translate([20,0,0]) linear_extrude(2) offset(r=-0.8) polygon([[0,0],[10,0],[10,4],[4,4],[4,10],[0,10]]);
translate([40,0,0]) linear_extrude(2) offset(delta=1) polygon([[0,0],[10,0],[2,3]]);
translate([60,0,0]) linear_extrude(2) offset(delta=1,chamfer=true) polygon([[0,0],[10,0],[10,4],[4,4],[4,10],[0,10]]);
translate([0,20,0]) linear_extrude(2) offset(delta=-1,chamfer=true) polygon([[0,0],[10,0],[10,4],[4,4],[4,10],[0,10]]);
translate([20,20,0]) linear_extrude(2) offset(r=-3) offset(r=3) { square([10,3],center=true); square([3,10],center=true);}
translate([40,20,0]) linear_extrude(2) offset(r=0.5,$fn=5) difference(){ square(10); translate([3,3]) square(4);}
translate([60,20,0]) linear_extrude(2) minkowski(){ difference(){ square(10); translate([3,3]) square(4);} circle(1,$fn=6);}
translate([0,40,0]) linear_extrude(2) hull(){ circle(2); translate([6,3]) square(2);}
translate([20,40,0]) linear_extrude(2) resize([9,0],auto=true) circle(2,$fn=5);
