// The same picture as parts.kdl beside it, object by object.
#version 3.7;
#include "common.inc"
#declare Ambient = 0.2;

Camera(<46, -96, 66>, <0, -3, 7>, z, 34)
Point_light(<-50, -70, 110>, <22000, 21000, 20000>)
Directional_light(<-0.6, 0.5, -1.2>, <0.7, 0.75, 0.8>)

box { <-50, -45, -4>, <50, 45, 0> Matte(<0.42, 0.38, 0.34>) }

#macro Steel() Matte(<0.50, 0.52, 0.56>) #end

// POV-Ray's tori lie around y.
#macro Ring(Radius, Tube, Height)
    torus { Radius, Tube rotate 90 * x translate Height * z }
#end

difference {
    intersection {
        box { <-17, -17, 0>, <17, 17, 6> }
        cylinder { -z, 7 * z, 21 }
    }
    union {
        cylinder { -z, 7 * z, 4 }
        cone { 4 * z, 4, 6.2 * z, 6.2 }
        #for (I, 0, 5)
            cylinder { -z, 7 * z, 1.6 translate 13 * x rotate (60 * I + 15) * z }
            cone { 5 * z, 1.6, 6.2 * z, 2.8 translate 13 * x rotate (60 * I + 15) * z }
        #end
        #for (I, 0, 11)
            sphere { 0, 1.2 translate <8.6, 0, 6.3> rotate 30 * I * z }
        #end
        union {
            box { <-5, -1, -1>, <5, 1, 7> }
            cylinder { <-5, 0, -1>, <-5, 0, 7>, 1 }
            cylinder { <5, 0, -1>, <5, 0, 7>, 1 }
            translate -15 * y
        }
        Steel()
    }
    Matte(<0.65, 0.12, 0.08>)
    translate <-16, 14, 0>
}

union {
    difference {
        intersection {
            #for (I, 0, 2)
                box { <-50, -7, 0.01 - I>, <50, 7, 5.5 + I> rotate 60 * I * z }
            #end
            cone { 6 * z, 14, -0.5 * z, 7.5 }
        }
        sphere { -19.5 * z, 20 }
    }
    difference {
        union {
            cylinder { 5 * z, 26 * z, 4 }
            cone { 26 * z, 4, 27 * z, 3 }
        }
        #for (I, 0, 9)
            Ring(4.05, 0.68, 25.5 - 1.5 * I)
        #end
    }
    Matte(<0.70, 0.52, 0.20>)
    translate <19, 9, 0>
}

difference {
    intersection {
        #for (I, 0, 2)
            box { <-50, -7, 0.01 - I>, <50, 7, 6.5 + I> rotate 60 * I * z }
        #end
        cone { -0.5 * z, 11.2, 7 * z, 7.2 }
    }
    cylinder { -z, 7 * z, 4.1 }
    #for (I, 0, 2)
        Ring(4.1, 0.6, 1.7 + 1.5 * I)
    #end
    Steel()
    rotate 20 * z
    translate <30, -17, 0>
}

difference {
    cylinder { -0.7 * z, 0.7 * z, 6.8 }
    cylinder { -2 * z, 2 * z, 4.2 }
    Steel()
    rotate 55 * x
    rotate 20 * z
    translate <22, -3.4, 6.1>
}

#declare Pip = sphere { 11.16 * z, 2.06 }
#declare Two = union { object { Pip translate <5, 5, 0> } object { Pip translate <-5, -5, 0> } }
#declare Four = union { object { Two } object { Two rotate 90 * z } }
difference {
    intersection {
        box { -10, 10 }
        sphere { 0, 14.2 }
        Matte(<0.80, 0.76, 0.66>)
    }
    union {
        object { Pip }
        union { object { Four } object { Pip translate 5 * x } object { Pip translate -5 * x } rotate 180 * x }
        object { Two rotate 90 * x }
        union { object { Four } object { Pip } rotate -90 * x }
        union { object { Two } object { Pip } rotate 90 * y }
        object { Four rotate -90 * y }
        Matte(<0.05, 0.05, 0.07>)
    }
    scale 0.8
    rotate 28 * z
    translate <-4, -23, 8.01>
}

union {
    cylinder { 0.01 * z, 3 * z, 9.5 }
    Ring(8, 1.5, 1.6)
    cone { 3 * z, 9, 5.5 * z, 6.6 }
    Ring(6, 0.9, 6)
    cone { 5.5 * z, 6.4, 14 * z, 4.4 }
    cone { 14 * z, 4.4, 23 * z, 5.6 }
    Ring(5.6, 0.9, 23)
    difference {
        union {
            cone { 23 * z, 5.8, 25.5 * z, 7.8 }
            cylinder { 25.5 * z, 32 * z, 7.8 }
        }
        cylinder { 28 * z, 35 * z, 5.2 }
        #for (I, 0, 5)
            box { <0, -1.7, 29.5>, <20, 1.7, 35> rotate 60 * I * z }
        #end
    }
    Matte(<0.55, 0.36, 0.18>)
    translate <-34, -16, 0>
}
