// The same picture as sponge.kdl beside it. Declare=Bounded=1 puts what a patient author would add by hand around
// the bubbles: POV-Ray bounds whole objects by itself, but not the members of a difference. Declare=Side=5 makes 125.
#version 3.7;
#include "common.inc"
#declare Ambient = 0.25;
#ifndef (Side) #declare Side = 10; #end
#declare Pitch = 50 / Side;
#ifndef (Bounded) #declare Bounded = 0; #end

Camera(<62, -100, 66>, <1, 1, -6>, z, 36)
Point_light(<70, -90, 130>, <30000, 29000, 27000>)
Directional_light(<0.6, 0.5, -0.6>, <0.5, 0.55, 0.65>)

box { <-45, -45, -30>, <45, 45, -26> Matte(<0.35, 0.36, 0.40>) }

#declare Rind = Matte(<0.78, 0.55, 0.16>);
#macro Bubble(X, Y, Z)
    sphere {
        Pitch * <X + 0.5 + 0.34 * sin(radians(47 * X + 113 * Y + 59 * Z)),
                 Y + 0.5 + 0.34 * sin(radians(61 * X + 29 * Y + 131 * Z)),
                 Z + 0.5 + 0.34 * sin(radians(101 * X + 83 * Y + 37 * Z))> - 25,
        Pitch * (0.38 + 0.12 * sin(radians(137 * X + 71 * Y + 23 * Z)))
    }
#end
// Around the bubbles from cell A to cell B: 0.34 off their cell's centre, with a radius of 0.5 at most.
#macro Bounds(A, B)
    bounded_by { box { Pitch * (A - 0.34) - 25, Pitch * (B + 1.34) - 25 } }
#end

difference {
    box { -25, 25 texture { Rind } }
    union {
        #for (X, 0, Side - 1)
            #if (Bounded) union { #end
            #for (Y, 0, Side - 1)
                #if (Bounded) union { #end
                #for (Z, 0, Side - 1)
                    Bubble(X, Y, Z)
                #end
                #if (Bounded) Bounds(<X, Y, 0>, <X, Y, Side - 1>) } #end
            #end
            #if (Bounded) Bounds(<X, 0, 0>, <X, Side - 1, Side - 1>) } #end
        #end
        Matte(<0.88, 0.76, 0.42>)
    }
    box { <0, -30, 10>, <30, 0, 30> texture { Rind } }
}
