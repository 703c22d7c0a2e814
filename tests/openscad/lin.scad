linear_extrude(height=6,twist=120,scale=0.4,slices=20) difference(){ square(8,center=true); circle(2); translate([3,3]) circle(0.5);}
translate([15,0,0]) linear_extrude(height=6,twist=-60) translate([2,0]) square([3,2]);
translate([30,0,0]) linear_extrude(height=6,scale=[0.3,1.5]) circle(3,$fn=7);
translate([0,15,0]) linear_extrude(height=6,scale=0) polygon([[0,0],[4,0],[4,4],[2,1],[0,4]]);
translate([15,15,0]) linear_extrude(height=6,center=true) polygon([[0,0],[6,0],[6,6],[0,6],[1,1],[5,1],[5,5],[1,5]],paths=[[0,1,2,3],[4,5,6,7]]);
translate([30,15,0]) linear_extrude(height=3,twist=45,scale=1.5,$fn=20) square(4);
translate([45,0,0]) linear_extrude(height=3) { square([5,1]); square([1,5]); translate([3,3]) circle(1.5);}
