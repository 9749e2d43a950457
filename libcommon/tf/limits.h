/* What numbers may be, so that what is made of them stays finite in float. */
#ifndef VOL_TF_LIMITS_H
#define VOL_TF_LIMITS_H

/* The most that colours, strengths, factors of shading and lights may be: products of three are still numbers in float. */
#define VOL_BRIGHTEST 1e18

#endif
