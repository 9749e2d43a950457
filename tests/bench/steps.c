/* How many steps there are in a picture:  steps EX,EY,EZ LX,LY,LZ UX,UY,UZ FOV WxH X,Y,Z STEP
 *
 * The eye, the point looked at, upwards, the vertical angle in degrees, the size in pixels; the far corner of a box whose
 * near one is the origin; the length of a step.  Printed is the sum, over the rays through the middles of all pixels, of
 * the length within the box divided by the step, whatever a renderer skips of it. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct Vec {
    double at[3];
} Vec;

static Vec sum_of(double a, Vec x, double b, Vec y)
{
    return (Vec){{a * x.at[0] + b * y.at[0], a * x.at[1] + b * y.at[1], a * x.at[2] + b * y.at[2]}};
}

static Vec cross(Vec x, Vec y)
{
    return (Vec){{x.at[1] * y.at[2] - x.at[2] * y.at[1], x.at[2] * y.at[0] - x.at[0] * y.at[2],
                  x.at[0] * y.at[1] - x.at[1] * y.at[0]}};
}

static Vec unit(Vec x)
{
    double length = sqrt(x.at[0] * x.at[0] + x.at[1] * x.at[1] + x.at[2] * x.at[2]);
    return sum_of(1 / length, x, 0, x);
}

static bool read_vec(const char *text, Vec *out)
{
    return sscanf(text, "%lf,%lf,%lf", &out->at[0], &out->at[1], &out->at[2]) == 3;
}

/* The length of a ray of unit direction within the box from 0 to `far`. */
static double length_inside(Vec from, Vec direction, Vec far)
{
    double enter = 0, leave = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        double a = -from.at[k] / direction.at[k], b = (far.at[k] - from.at[k]) / direction.at[k];
        enter = fmax(enter, fmin(a, b)); /* of NaN, where it runs along a face, fmax takes the other */
        leave = fmin(leave, fmax(a, b));
    }
    return fmax(0, leave - enter);
}

int main(int argc, char **argv)
{
    Vec eye, target, up, far;
    unsigned width, height;
    if (argc != 8 || !read_vec(argv[1], &eye) || !read_vec(argv[2], &target) || !read_vec(argv[3], &up) ||
        sscanf(argv[5], "%ux%u", &width, &height) != 2 || !read_vec(argv[6], &far) || strtod(argv[7], NULL) <= 0) {
        fprintf(stderr, "usage: steps EX,EY,EZ LX,LY,LZ UX,UY,UZ FOV WxH X,Y,Z STEP\n");
        return 2;
    }
    Vec ahead = unit(sum_of(1, target, -1, eye)), right = unit(cross(ahead, up)), above = cross(right, ahead);
    double pixel = 2 * tan(strtod(argv[4], NULL) * 3.14159265358979323846 / 360) / height, sum = 0;
    for (unsigned y = 0; y < height; y++)
        for (unsigned x = 0; x < width; x++) {
            Vec across = sum_of((x + 0.5 - width / 2.0) * pixel, right, (height / 2.0 - y - 0.5) * pixel, above);
            sum += length_inside(eye, unit(sum_of(1, ahead, 1, across)), far);
        }
    printf("%.0f\n", sum / strtod(argv[7], NULL));
    return 0;
}
