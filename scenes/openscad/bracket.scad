// An angle bracket with a bolt and its nut, for `openscad -o bracket.csg bracket.scad`.
$fn = 48;
thick = 6;

// A plate with round corners and two holes for bolts.
module plate(length, width) {
    difference() {
        linear_extrude(thick) offset(r = 5) translate([5, 5 - width / 2]) square([length - 10, width - 10]);
        for (y = [-width / 4, width / 4]) translate([length - 14, y, -1]) cylinder(d = 9, h = thick + 2);
    }
}

// A rib whose edge is rounded: the hull of three cylinders.
module rib() {
    translate([0, thick / 2, 0]) rotate([90, 0, 0]) hull() {
        translate([thick, thick, 0]) cylinder(r = 1, h = thick);
        translate([32, thick, 0]) cylinder(r = 1, h = thick);
        translate([thick, 32, 0]) cylinder(r = 1, h = thick);
    }
}

module bolt(length) {
    cylinder(d = 8, h = length);
    translate([0, 0, -5]) linear_extrude(5, scale = 1) offset(r = 1, $fn = 12) circle(d = 12, $fn = 6);
    translate([0, 0, -5]) mirror([0, 0, 1]) rotate_extrude() polygon([[0, 0], [6, 0], [4, 1.2], [0, 1.6]]);
}

module nut() {
    difference() {
        cylinder(d = 15, h = 6, $fn = 6);
        translate([0, 0, -1]) cylinder(d = 8, h = 8);
        for (z = [-1, 7]) translate([0, 0, z]) minkowski() { cylinder(d = 7, h = 0.01); sphere(1.6, $fn = 16); }
    }
}

color("SteelBlue") {
    plate(60, 50);
    multmatrix([[0, 0, 1, 0], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 1]]) plate(60, 50);
    rib();
}
color("Silver") translate([46, 12.5, -0.01]) bolt(18);
translate([46, 12.5, thick]) color("Goldenrod") nut();
