sphere(r=10); translate([25,0,0]) sphere(r=5,$fn=7); translate([0,25,0]) sphere(r=5,$fn=8); translate([25,25,0]) sphere(r=4,$fn=3);
