rotate_extrude() translate([5,0]) circle(2);
translate([20,0,0]) rotate_extrude(angle=120,$fn=24) translate([3,0]) square([2,4]);
translate([0,20,0]) rotate_extrude($fn=9) polygon([[0,0],[4,0],[1,3],[3,6],[0,7]]);
translate([20,20,0]) rotate_extrude(angle=-200) translate([-4,0]) difference(){circle(2); circle(1);}
translate([40,0,0]) rotate_extrude($fn=5) square(3);
