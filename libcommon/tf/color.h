/* Inside tf/: sRGB, and the ways in which other programs blend two of its colours. */
#ifndef VOL_TF_COLOR_H
#define VOL_TF_COLOR_H

typedef enum VolColorSpace {
    VOL_COLOR_RGB,       /* linear in the encoded values */
    VOL_COLOR_HSV,       /* hue through the numbers between, however far */
    VOL_COLOR_HSV_WRAP,  /* hue the shorter way round */
    VOL_COLOR_LAB,       /* CIE L*a*b* */
    VOL_COLOR_DIVERGING, /* Moreland's Msh, through white or grey where both ends are saturated and differ in hue */
    VOL_COLOR_STEP       /* none: the colour of the point above */
} VolColorSpace;

/* sRGB to linear Rec.709 (IEC 61966-2-1), per channel. */
void vol_color_decode(const double encoded[3], double linear[3]);

/* Between the encoded colours a (u = 0) and b (u = 1); the result is encoded, within [0, 1]. */
void vol_color_blend(VolColorSpace space, const double a[3], const double b[3], double u, double out[3]);

#endif
