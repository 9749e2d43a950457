/* Turns closed forms into renderings:  closed_forms CLOSED_FORMS.json CELL_REFERENCE.json
 *
 * Every case becomes a volume, a transfer function and a one-pixel `vol-render` command in the current folder.  A scene
 * is built so that its field is trilinear on the voxels wherever the physics allows it; then the only errors are the
 * renderer's, and they must stay below 2e-6 relative (1e-7 floor) in float and 1e-12 relative with --precise --probe.
 * Curved fields that no voxels can hold (`order:` in the names) must approach the closed form with the square of the
 * voxel size instead: the order seen between two refinements lies in 1.7 .. 2.3.
 *
 * Rays run along +z unless said otherwise, from an eye on the -z side: the front of the ray is at low z.
 * Extinctions are handed over as opacities of a particle step so short that 1 - exp(-mu step) <= 0.4: in that range the
 * round trip through log1p costs about one rounding. */
#include "io/vdb.h"
#include "tool.h"

typedef struct Case Case;
struct Case {
    char name[192];
    int32_t dims[3];
    VolAffine map;
    double (*field)(const Case *c, VolVec3 x); /* in world space */
    double p[8];                               /* its parameters */
    Text tf;
    VolVec3 eye, look_at;
    const char *options;
    struct {
        const char *channel;
        double value;
    } wants[6];
    size_t want_count;
};

static const VolAffine unit_map = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

static void want(Case *c, const char *channel, double value)
{
    c->wants[c->want_count].channel = channel;
    c->wants[c->want_count++].value = value;
}

/* Grey light: R and alpha say it all. */
static void want_grey(Case *c, double colour, double alpha)
{
    want(c, "R", colour);
    want(c, "G", colour);
    want(c, "A", alpha);
}

/* ---- scenes to files ---- */

static void check(VolStatus status, const VolError *err)
{
    if (status != VOL_OK)
        die("%s", err->text);
}

static void write_volume(const Case *c)
{
    const int32_t *n = c->dims, origin[3] = {0, 0, 0};
    size_t count = (size_t)n[0] * (size_t)n[1] * (size_t)n[2], at = 0;
    double *values = malloc(count * sizeof *values);
    if (!values)
        die("out of memory");
    for (int32_t k = 0; k < n[2]; k++)
        for (int32_t j = 0; j < n[1]; j++)
            for (int32_t i = 0; i < n[0]; i++)
                values[at++] = c->field(c, vol_apply(&c->map, vol_vec3(i, j, k)));
    VolError err = {""};
    VolVdbWriter *writer = NULL;
    VolVdbNewGrid grid = {.name = "density", .store = VOL_STORE_DOUBLE, .index_to_world = c->map};
    check(vol_vdb_writer_new(VOL_COMPRESS_BLOSC, &writer, &err), &err);
    check(vol_vdb_begin_grid(writer, &grid, &err), &err);
    check(vol_vdb_put_dense_double(writer, origin, n, values, &err), &err);
    check(vol_vdb_end_grid(writer, &err), &err);
    VolBytes bytes = {0};
    check(vol_vdb_finish(writer, &bytes, &err), &err);
    write_file("case.vdb", bytes.data, bytes.size);
    vol_bytes_free(&bytes);
    vol_vdb_writer_free(writer);
    free(values);
}

static void write_case(const Case *c)
{
    write_volume(c);
    write_file("case.json", c->tf.bytes, c->tf.size);
}

static void command_of(const Case *c, const char *mode, Text *out)
{
    text_add(out, "vol-render -t case.json --size 1x1 --ortho 0.001 %s %s --eye %.17g,%.17g,%.17g"
                  " --look-at %.17g,%.17g,%.17g case.vdb",
             mode, c->options ? c->options : "", c->eye.x, c->eye.y, c->eye.z, c->look_at.x, c->look_at.y, c->look_at.z);
}

/* ---- checks ---- */

static bool float_agrees(const Case *c, char *why, size_t why_size)
{
    Text command = {.size = 0};
    command_of(c, "-o case.exr", &command);
    VolImage image = {0};
    bool good = run_well(command.bytes, why, why_size) && read_image("case.exr", &image, why, why_size);
    for (size_t i = 0; good && i < c->want_count; i++)
        good = near(pixel(&image.parts[0], c->wants[i].channel, 0, 0), c->wants[i].value, 2e-6, 1e-7,
                    c->wants[i].channel, why, why_size);
    vol_image_free(&image);
    return good;
}

/* The channels of pixel 0,0 in double; NULL and a reason on failure.  The caller releases *whole. */
static json_t *probe(const Case *c, json_t **whole, char *why, size_t why_size)
{
    Text command = {.size = 0};
    command_of(c, "--precise --probe 0,0", &command);
    text_add(&command, " >probe.json");
    *whole = NULL;
    if (!run_well(command.bytes, why, why_size))
        return NULL;
    json_error_t error;
    *whole = json_load_file("probe.json", 0, &error);
    json_t *channels = *whole ? probed_channels(*whole, 0, 0) : NULL;
    if (!channels)
        snprintf(why, why_size, "--probe wrote no pixel 0,0");
    return channels;
}

static double probed(json_t *channels, const char *name)
{
    json_t *value = json_object_get(channels, name);
    return json_is_number(value) ? json_number_value(value) : (double)NAN;
}

static bool precise_agrees(const Case *c, char *why, size_t why_size)
{
    json_t *whole, *channels = probe(c, &whole, why, why_size);
    bool good = channels != NULL;
    for (size_t i = 0; good && i < c->want_count; i++)
        good = near(probed(channels, c->wants[i].channel), c->wants[i].value, 1e-12, 0, c->wants[i].channel, why,
                    why_size);
    json_decref(whole);
    return good;
}

static void run_case(const Case *c)
{
    char why[4096] = "";
    write_case(c);
    tap(float_agrees(c, why, sizeof why) ? NULL : why, "%s float", c->name);
    tap(precise_agrees(c, why, sizeof why) ? NULL : why, "%s precise", c->name);
}

/* Optical depth of the whole ray, from a probe in double. */
static double optical_depth(const Case *c, char *why, size_t why_size)
{
    write_case(c);
    json_t *whole, *channels = probe(c, &whole, why, why_size);
    double tau = channels ? -log1p(-probed(channels, "A")) : (double)NAN;
    json_decref(whole);
    return tau;
}

/* Errors at voxel sizes h, h/2, h/4 must fall with their square. */
static void judge_order(const char *name, const double errors[3], const char *trouble)
{
    char why[8192];
    double first = log2(errors[0] / errors[1]), second = log2(errors[1] / errors[2]);
    bool good = first > 1.7 && first < 2.3 && second > 1.7 && second < 2.3;
    snprintf(why, sizeof why, "errors %.3g %.3g %.3g: orders %.2f and %.2f\n%.4000s", errors[0], errors[1], errors[2],
             first, second, trouble);
    tap(good ? NULL : why, "order: %s", name);
}

/* ---- reading the cases ---- */

static double as_number(json_t *object, const char *key)
{
    json_t *value = json_object_get(object, key);
    if (json_is_number(value))
        return json_number_value(value);
    if (!json_is_string(value))
        die("a case has no '%s'", key);
    return strtod(json_string_value(value), NULL); /* "inf" and values beyond double's range included */
}

static const char *as_text(json_t *object, const char *key)
{
    const char *text = json_string_value(json_object_get(object, key));
    return text ? text : die("a case has no '%s'", key), text;
}

static json_t *cases_of(json_t *file, const char *family)
{
    json_t *cases = json_object_get(json_object_get(file, family), "cases");
    if (!json_array_size(cases))
        die("no cases of '%s'", family);
    return cases;
}

/* ---- parts of scenes ---- */

static double opacity(double extinction, double step) { return -expm1(-extinction * step); }

/* A step in which the largest extinction has opacity 0.4. */
static double step_for(double extinction) { return extinction > 0 ? 0.5 / extinction : 1; }

static void begin_tf(Case *c, double particle_step, double scalar_step)
{
    text_add(&c->tf, "{\"pellucid\": \"transfer-function/1\", \"interpolate\": \"extinction\", \"model\": \"unshaded\",\n"
                     " \"particle_step\": %.17g, \"scalar_step\": %.17g", particle_step, scalar_step);
}
static void begin_list(Case *c, const char *name) { text_add(&c->tf, ",\n \"%s\": [", name); }
static void node(Case *c, double v, double amount, double r, double g, double b)
{
    bool first = c->tf.bytes[c->tf.size - 1] == '[';
    text_add(&c->tf, "%s[%.17g, %.17g, [%.17g, %.17g, %.17g]]", first ? "" : ", ", v, amount, r, g, b);
}
static void grey_node(Case *c, double v, double amount, double colour) { node(c, v, amount, colour, colour, colour); }
static void end_list(Case *c) { text_add(&c->tf, "]"); }
static void end_tf(Case *c) { text_add(&c->tf, "}\n"); }

static double constant(const Case *c, VolVec3 x)
{
    (void)x;
    return c->p[0];
}
/* p0 x + p1 z + p2 */
static double linear(const Case *c, VolVec3 x) { return c->p[0] * x.x + c->p[1] * x.z + c->p[2]; }
/* p0 x + p1 |z| */
static double tent(const Case *c, VolVec3 x) { return c->p[0] * x.x + c->p[1] * fabs(x.z); }

/* A box x, y in [-1, 1], z from z0 on, n voxels `dz` apart; the eye stands one length before it. */
static Case slab(double z0, double dz, int32_t n)
{
    Case c = {.dims = {2, 2, n}, .field = constant, .map = unit_map};
    c.map.m[0][0] = c.map.m[1][1] = 2;
    c.map.m[2][2] = dz;
    c.map.m[3][0] = c.map.m[3][1] = -1;
    c.map.m[3][2] = z0;
    double length = dz * (n - 1);
    c.eye = vol_vec3(0, 0, z0 - length);
    c.look_at = vol_vec3(0, 0, z0);
    return c;
}

/* ---- families: exact ---- */

static void homogeneous_slab(json_t *k)
{
    double sigma = as_number(k, "sigma"), colour = as_number(k, "c"), step = step_for(sigma);
    Case c = slab(0, as_number(k, "L"), 2);
    snprintf(c.name, sizeof c.name, "homogeneous_slab sigma %s L %s", as_text(k, "sigma"), as_text(k, "L"));
    c.p[0] = 0.5;
    begin_tf(&c, step, 1);
    begin_list(&c, "scatter");
    grey_node(&c, 0, opacity(sigma, step), colour);
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), as_number(k, "alpha"));
    run_case(&c);
}

/* Along the chord the sphere is an interval: v = |z|, extinction up to the jump at half the chord. */
static void homogeneous_sphere(json_t *k)
{
    if (!json_object_get(k, "b"))
        return; /* the mean over the disk is a quadrature of the others */
    double sigma = as_number(k, "sigma"), half = as_number(k, "chord") / 2, step = step_for(sigma);
    Case c = slab(-2, 2, 3);
    snprintf(c.name, sizeof c.name, "homogeneous_sphere (by a jump) sigma %s b %s", as_text(k, "sigma"), as_text(k, "b"));
    c.field = tent;
    c.p[1] = 1;
    begin_tf(&c, step, 1);
    begin_list(&c, "scatter");
    if (half > 0)
        grey_node(&c, 0, opacity(sigma, step), 1);
    grey_node(&c, half, opacity(sigma, step), 1);
    grey_node(&c, half, 0, 1);
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), as_number(k, "C"));
    run_case(&c);
}

static void linear_ramp(json_t *k)
{
    double front = as_number(k, "tau_f"), back = as_number(k, "tau_b"), length = as_number(k, "D");
    double step = step_for(fmax(front, back) / length);
    Case c = slab(0, length, 2);
    snprintf(c.name, sizeof c.name, "linear_ramp %s to %s", as_text(k, "tau_f"), as_text(k, "tau_b"));
    c.field = linear;
    c.p[1] = 1 / length;
    begin_tf(&c, step, 1);
    begin_list(&c, "scatter");
    grey_node(&c, 0, opacity(front / length, step), as_number(k, "c_f"));
    grey_node(&c, 1, opacity(back / length, step), as_number(k, "c_b"));
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), -expm1(-(front + back) / 2));
    run_case(&c);
}

/* The field is the depth; the layers are jumps of the transfer function. */
static void ordered_slabs(json_t *k, size_t index)
{
    json_t *layers = json_object_get(k, "front_to_back_sigma_L_c"), *layer;
    size_t i;
    double length = 0, largest = 0, z = 0;
    double s[8], l[8], colour[8];
    json_array_foreach (layers, i, layer) {
        s[i] = strtod(json_string_value(json_array_get(layer, 0)), NULL);
        l[i] = strtod(json_string_value(json_array_get(layer, 1)), NULL);
        colour[i] = strtod(json_string_value(json_array_get(layer, 2)), NULL);
        length += l[i];
        largest = fmax(largest, s[i]);
    }
    double step = step_for(largest);
    Case c = slab(0, length, 2);
    snprintf(c.name, sizeof c.name, "ordered_slabs %zu", index);
    c.field = linear;
    c.p[1] = 1;
    begin_tf(&c, step, 1);
    begin_list(&c, "scatter");
    json_array_foreach (layers, i, layer) {
        grey_node(&c, z, opacity(s[i], step), colour[i]);
        z += l[i];
        grey_node(&c, z, opacity(s[i], step), colour[i]);
    }
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), 1 - as_number(k, "T"));
    run_case(&c);
}

static void emission_slab(json_t *k)
{
    double sigma = as_number(k, "sigma"), e = as_number(k, "e"), length = as_number(k, "L"), step = step_for(sigma);
    Case c = slab(0, length, 2);
    snprintf(c.name, sizeof c.name, "emission_slab sigma %s", as_text(k, "sigma"));
    begin_tf(&c, step, 1);
    begin_list(&c, "absorb"); /* black transmission: opacity = density in every channel */
    grey_node(&c, 0, opacity(sigma, step), 0);
    end_list(&c);
    begin_list(&c, "emit");
    grey_node(&c, 0, e * step, 1);
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), -expm1(-sigma * length));
    run_case(&c);
}

/* Two crossings of one isosurface in v = sin |..| : a tent whose gradient makes the angle that the sphere's normal makes
 * with the ray at impact b.  Seven voxels along z: those at the crossings (z = +-1.5) have their neighbours on one side
 * of the fold, so central differences are exact.  A ray that misses the sphere: a value that does not occur. */
static void iso_sphere_delta(json_t *k, size_t index, bool lambert)
{
    double r0 = as_number(k, "r0"), b = as_number(k, "b"), alpha = as_number(k, "alpha");
    double sine = fmin(b / r0, 1), cosine = sqrt(1 - sine * sine);
    Case c = slab(-3, 1, 7);
    snprintf(c.name, sizeof c.name, "iso_sphere_delta %zu%s", index, lambert ? " under a headlight" : "");
    c.field = tent;
    c.p[0] = sine;
    c.p[1] = b < r0 ? cosine : 1;
    text_add(&c.tf, "{\"pellucid\": \"transfer-function/1\", \"model\": \"%s\",\n"
                    " \"shading\": {\"ambient\": 0, \"diffuse\": 1, \"specular\": 0, \"shininess\": 1},\n"
                    " \"isosurfaces\": [{\"value\": %.17g, \"opacity\": %.17g, \"color\": [0.75, 0.75, 0.75]}]}\n",
             lambert ? "hybrid" : "unshaded", b < r0 ? 1.5 * cosine : -100, alpha);
    want_grey(&c, as_number(k, lambert ? "C_lambert_headlight" : "C"), 1 - as_number(k, "T"));
    run_case(&c);
}

/* v = r^2 along a ray whose lowest point is a voxel: surface extinction counts |dv| alone, so what the curve does between
 * voxels does not matter, and the unit sphere ends at a jump of the transfer function at v = 1. */
static double r_squared(const Case *c, VolVec3 x) { return c->p[0] + x.z * x.z; }
static void surface_density_r2(json_t *k, size_t index)
{
    double mu = as_number(k, "mu_sg"), b = as_number(k, "b"), step = step_for(mu);
    Case c = slab(-1.25, 0.25, 11);
    snprintf(c.name, sizeof c.name, "surface_density_r2 %zu", index);
    c.field = r_squared;
    c.p[0] = b * b;
    begin_tf(&c, 1, step);
    begin_list(&c, "surface");
    grey_node(&c, 0, opacity(mu, step), 0.6);
    grey_node(&c, 1, opacity(mu, step), 0.6);
    grey_node(&c, 1, 0, 0.6);
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), 1 - as_number(k, "T"));
    run_case(&c);
}

static void hybrid_linear_field(json_t *k)
{
    double theta = as_number(k, "theta_deg"), gradient = as_number(k, "grad"), angle = theta / 180 * acos(-1.0);
    double mu_sg = as_number(k, "mu_sg"), mu_p = as_number(k, "mu_p");
    double particle_step = step_for(mu_p), scalar_step = step_for(mu_sg);
    Case c = slab(0, as_number(k, "path"), 2);
    snprintf(c.name, sizeof c.name, "hybrid_linear_field theta %s", as_text(k, "theta_deg"));
    c.field = linear;
    c.p[0] = gradient * sin(angle);
    c.p[1] = theta == 90 ? 0 : gradient * cos(angle);
    begin_tf(&c, particle_step, scalar_step);
    begin_list(&c, "surface");
    grey_node(&c, 0, opacity(mu_sg, scalar_step), as_number(k, "c_s"));
    end_list(&c);
    begin_list(&c, "scatter");
    grey_node(&c, 0, opacity(mu_p, particle_step), as_number(k, "c_p"));
    end_list(&c);
    end_tf(&c);
    want_grey(&c, as_number(k, "C"), 1 - as_number(k, "T"));
    run_case(&c);
}

/* Shading that varies linearly from k0 at the front to k1 at the back is a colour linear in v: red carries it, green is
 * 1 throughout (all of the surface's alpha), blue goes from 0 to 1 (its back weight). */
static void front_back_weights(json_t *k, size_t index)
{
    double mu_sg = as_number(k, "mu_sg"), dv = as_number(k, "dv"), mu_p = as_number(k, "mu_p");
    double length = as_number(k, "l"), particle_step = step_for(mu_p), scalar_step = step_for(mu_sg);
    Case c = slab(0, length, 2);
    snprintf(c.name, sizeof c.name, "front_back_weights %zu", index);
    c.field = linear;
    c.p[1] = dv / length;
    c.options = "--aov surface";
    begin_tf(&c, particle_step, scalar_step);
    begin_list(&c, "surface");
    node(&c, 0, opacity(mu_sg, scalar_step), 0.6 * as_number(k, "k0"), 1, 0);
    node(&c, dv, opacity(mu_sg, scalar_step), 0.6 * as_number(k, "k1"), 1, 1);
    end_list(&c);
    begin_list(&c, "scatter");
    grey_node(&c, 0, opacity(mu_p, particle_step), 0);
    end_list(&c);
    end_tf(&c);
    want(&c, "surface.R", as_number(k, "C_k_linear"));
    want(&c, "surface.G", as_number(k, "alpha_s"));
    want(&c, "surface.B", as_number(k, "alpha_s_bw"));
    want(&c, "A", -expm1(-(mu_sg * dv + mu_p * length)));
    run_case(&c);
}

/* ---- one trilinear cell ---- */

static double corner(const Case *c, VolVec3 x)
{
    return c->p[((int)x.x * 2 + (int)x.y) * 2 + (int)x.z];
}

static double table(json_t *lists, const char *name, size_t i)
{
    return strtod(json_string_value(json_array_get(json_object_get(lists, name), i)), NULL);
}

static VolVec3 point(json_t *object, const char *key)
{
    double x[3];
    for (size_t a = 0; a < 3; a++)
        x[a] = strtod(json_string_value(json_array_get(json_object_get(object, key), a)), NULL);
    return vol_vec3(x[0], x[1], x[2]);
}

/* The source q_p is piecewise linear: black particles for the extinction, emission for the source.  The surfaces' source
 * c_s mu_sg is a product of two linear functions, as everywhere. */
static void cell(json_t *file, json_t *k, size_t index, bool hybrid)
{
    json_t *lists = json_object_get(file, "tf"), *corners = json_object_get(file, "corners_xyz");
    json_t *wanted = json_object_get(k, hybrid ? "hybrid" : "particle");
    Case c = {.dims = {2, 2, 2}, .map = unit_map, .field = corner};
    snprintf(c.name, sizeof c.name, "cell %zu %s", index, hybrid ? "hybrid" : "particles");
    for (size_t i = 0; i < 8; i++)
        c.p[i] = strtod(json_string_value(json_array_get(json_array_get(json_array_get(corners, i >> 2), i >> 1 & 1),
                                                         i & 1)), NULL);
    const double particle_step = step_for(6), scalar_step = step_for(4);
    size_t knots = json_array_size(json_object_get(lists, "knots"));
    begin_tf(&c, particle_step, scalar_step);
    begin_list(&c, "scatter");
    for (size_t i = 0; i < knots; i++)
        grey_node(&c, table(lists, "knots", i), opacity(table(lists, "mu_p", i), particle_step), 0);
    end_list(&c);
    begin_list(&c, "emit");
    for (size_t i = 0; i < knots; i++)
        grey_node(&c, table(lists, "knots", i), table(lists, "q_p", i) * particle_step, 1);
    end_list(&c);
    if (hybrid) {
        begin_list(&c, "surface");
        for (size_t i = 0; i < knots; i++)
            grey_node(&c, table(lists, "knots", i), opacity(table(lists, "mu_sg", i), scalar_step),
                      table(lists, "c_s", i));
        end_list(&c);
    }
    end_tf(&c);
    VolVec3 entry = point(k, "entry"), way = vol_sub(point(k, "exit"), entry);
    c.eye = vol_along(entry, -1, way);
    c.look_at = entry;
    c.options = way.x == 0 && way.z == 0 ? "--up 0,0,1" : "";
    want_grey(&c, as_number(wanted, "C"), -expm1(-as_number(wanted, "tau")));
    run_case(&c);
}

/* ---- families: the voxels themselves err; order 2 ---- */

/* exp(-z/H); the ray leaves the ground at an angle of cosine mu, downwards where mu < 0. */
static double atmosphere(const Case *c, VolVec3 x) { return exp(-x.z / c->p[0]); }
static void exp_atmosphere(json_t *k, size_t index)
{
    double sigma0 = as_number(k, "sigma0"), scale = as_number(k, "H"), mu = as_number(k, "mu");
    double length = fmin(as_number(k, "L"), 40 * scale / fabs(mu)); /* "inf": 40 scale heights leave exp(-40) */
    double height = length * fabs(mu), errors[3];
    char why[4096] = "", name[64];
    for (int level = 0; level < 3; level++) {
        int32_t cells = (int32_t)ceil(height / scale * 3) << level;
        Case c = slab(mu > 0 ? 0 : -height, height / cells, cells + 1);
        c.field = atmosphere;
        c.p[0] = scale;
        for (int a = 0; a < 2; a++) { /* wide enough for the slant */
            c.map.m[a][a] = 4 * length;
            c.map.m[3][a] = -2 * length;
        }
        double largest = mu > 0 ? 1 : exp(height / scale), step = step_for(sigma0 * largest);
        begin_tf(&c, step, 1);
        begin_list(&c, "scatter");
        grey_node(&c, 0, 0, 0.6);
        grey_node(&c, largest, opacity(sigma0 * largest, step), 0.6);
        end_list(&c);
        end_tf(&c);
        VolVec3 way = vol_vec3(sqrt(1 - mu * mu), 0, mu);
        c.eye = vol_vec3(0, 0, 0); /* rays start at the eye: the ground, exactly */
        c.look_at = way;
        errors[level] = fabs(optical_depth(&c, why, sizeof why) - as_number(k, "tau"));
    }
    snprintf(name, sizeof name, "exp_atmosphere %zu", index);
    judge_order(name, errors, why);
}

/* Two columns of voxels, the ray half way between them: the error across the ray and along it. */
static double gaussian(const Case *c, VolVec3 x)
{
    return exp(-(x.x * x.x + x.z * x.z) / (2 * c->p[0] * c->p[0]));
}
static void gaussian_blob(json_t *k, size_t index)
{
    double peak = as_number(k, "A"), s = as_number(k, "s"), b = as_number(k, "b");
    double t0 = fmax(as_number(k, "t0"), -8 * s), t1 = fmin(as_number(k, "t1"), 8 * s), errors[3];
    double step = step_for(peak);
    char why[4096] = "", name[64];
    for (int level = 0; level < 3; level++) {
        int32_t cells = (int32_t)ceil((t1 - t0) / s * 5) << level;
        double h = (t1 - t0) / cells;
        Case c = slab(t0, h, cells + 1);
        c.field = gaussian;
        c.p[0] = s;
        c.map.m[0][0] = h;
        c.map.m[3][0] = b - h / 2;
        c.eye.x = c.look_at.x = b;
        begin_tf(&c, step, 1);
        begin_list(&c, "scatter");
        grey_node(&c, 0, 0, 0.8);
        grey_node(&c, 1, opacity(peak, step), 0.8);
        end_list(&c);
        end_tf(&c);
        errors[level] = fabs(optical_depth(&c, why, sizeof why) - as_number(k, "tau"));
    }
    snprintf(name, sizeof name, "gaussian_blob %zu", index);
    judge_order(name, errors, why);
}

/* A whole sphere, v = r^2 with a jump at 1, seen in 24 x 24 pixels: the mean error of alpha over the disk. */
static double bowl(const Case *c, VolVec3 x)
{
    (void)c;
    return vol_dot(x, x);
}
static void whole_sphere(void)
{
    enum { SIDE = 24 };
    const double sigma = 1, view = 2.2, step = step_for(sigma);
    double errors[3];
    char why[4096] = "";
    for (int level = 0; level < 3; level++) {
        int32_t n = (int32_t)(12 << level) + 1;
        double h = 2.4 / (n - 1);
        Case c = {.dims = {n, n, n}, .field = bowl, .map = unit_map};
        for (int a = 0; a < 3; a++) {
            c.map.m[a][a] = h;
            c.map.m[3][a] = -1.2;
        }
        begin_tf(&c, step, 1);
        begin_list(&c, "scatter");
        grey_node(&c, 1, opacity(sigma, step), 1);
        grey_node(&c, 1, 0, 1);
        end_list(&c);
        end_tf(&c);
        write_case(&c);
        char command[512];
        snprintf(command, sizeof command, "vol-render -t case.json --size %dx%d --ortho %g --eye 0,0,-5 --look-at 0,0,0"
                                          " -o case.exr case.vdb", SIDE, SIDE, view);
        VolImage image = {0};
        errors[level] = (double)NAN;
        if (run_well(command, why, sizeof why) && read_image("case.exr", &image, why, sizeof why)) {
            double sum = 0;
            for (int y = 0; y < SIDE; y++)
                for (int x = 0; x < SIDE; x++) {
                    double px = ((x + 0.5) / SIDE - 0.5) * view, py = ((y + 0.5) / SIDE - 0.5) * view;
                    double half = sqrt(fmax(0, 1 - px * px - py * py));
                    sum += fabs(pixel(&image.parts[0], "A", x, y) - -expm1(-2 * half * sigma));
                }
            errors[level] = sum / (SIDE * SIDE);
        }
        vol_image_free(&image);
    }
    judge_order("homogeneous_sphere, the whole of it", errors, why);
}

/* ---- all ---- */

int main(int argc, char **argv)
{
    if (argc != 3)
        die("usage: closed_forms CLOSED_FORMS.json CELL_REFERENCE.json");
    json_t *closed = read_json(argv[1]), *cells = read_json(argv[2]), *k;
    size_t i;
#define EACH(family) json_array_foreach (cases_of(closed, family), i, k)
    EACH("homogeneous_slab") homogeneous_slab(k);
    EACH("homogeneous_sphere") homogeneous_sphere(k);
    EACH("linear_ramp") linear_ramp(k);
    EACH("ordered_slabs") ordered_slabs(k, i);
    EACH("emission_slab") emission_slab(k);
    EACH("iso_sphere_delta") iso_sphere_delta(k, i, false);
    EACH("iso_sphere_delta") iso_sphere_delta(k, i, true);
    EACH("surface_density_r2") surface_density_r2(k, i);
    EACH("hybrid_linear_field") hybrid_linear_field(k);
    EACH("front_back_weights") front_back_weights(k, i);
    json_array_foreach (json_object_get(cells, "cases"), i, k) {
        cell(cells, k, i, false);
        cell(cells, k, i, true);
    }
    EACH("exp_atmosphere") exp_atmosphere(k, i);
    EACH("gaussian_blob") gaussian_blob(k, i);
    whole_sphere();
#undef EACH
    json_decref(closed);
    json_decref(cells);
    return tap_end();
}
