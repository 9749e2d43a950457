/* Makes small images of constant channels for the tests, on stdout.
 *
 *     makeexr [--window X0,Y0,X1,Y1] [--display X0,Y0,X1,Y1] [--half] [--poke X,Y,CHANNEL=VALUE] WxH CHANNEL=VALUE...
 *
 * Values may be nan, inf or -inf. */
#include "tool.h"

static VolBox2 box(const char *text)
{
    VolBox2 b;
    int n = 0;
    if (sscanf(text, "%d,%d,%d,%d%n", &b.x0, &b.y0, &b.x1, &b.y1, &n) != 4 || text[n])
        die("'%s' is not X0,Y0,X1,Y1", text);
    return b;
}

/* "R=0.5": fills the channel of that name, made where it is new; with x >= 0 one pixel of it. */
static void set(VolPart *part, VolPixel store, const char *text, int x, int y)
{
    char name[64];
    const char *equals = strchr(text, '=');
    if (!equals || (size_t)(equals - text) >= sizeof name)
        die("'%s' is not CHANNEL=VALUE", text);
    snprintf(name, sizeof name, "%.*s", (int)(equals - text), text);
    char *end = NULL;
    float value = strtof(equals + 1, &end);
    if (end == equals + 1 || *end)
        die("'%s' is not a number", equals + 1);
    VolChannel *channel = vol_part_channel(part, name);
    VolError err = {""};
    if (!channel && vol_part_add_channel(part, name, store, &channel, &err) != VOL_OK)
        die("%s", err.text);
    size_t width = vol_box2_width(part->data_window), height = vol_box2_height(part->data_window);
    if (x >= 0) {
        if ((size_t)x >= width || (size_t)y >= height)
            die("no pixel %d,%d", x, y);
        channel->data[(size_t)y * width + (size_t)x] = value;
    } else {
        for (size_t i = 0; i < width * height; i++)
            channel->data[i] = value;
    }
}

int main(int argc, char **argv)
{
    const char *window = NULL, *display = NULL, *pokes[8];
    size_t poke_count = 0;
    VolPixel store = VOL_PIXEL_FLOAT;
    int i = 1;
    for (; i < argc && argv[i][0] == '-'; i++) {
        if (strcmp(argv[i], "--half") == 0)
            store = VOL_PIXEL_HALF;
        else if (i + 1 >= argc)
            die("'%s' wants a value", argv[i]);
        else if (strcmp(argv[i], "--window") == 0)
            window = argv[++i];
        else if (strcmp(argv[i], "--display") == 0)
            display = argv[++i];
        else if (strcmp(argv[i], "--poke") == 0 && poke_count < 8)
            pokes[poke_count++] = argv[++i];
        else
            die("unknown option '%s'", argv[i]);
    }
    int width = 0, height = 0;
    if (i >= argc || sscanf(argv[i], "%dx%d", &width, &height) != 2 || width < 1 || height < 1)
        die("usage: makeexr [options] WxH CHANNEL=VALUE...");
    VolBox2 whole = {0, 0, width - 1, height - 1};
    VolImage image = {0};
    VolPart *part = NULL;
    VolError err = {""};
    if (vol_image_add_part(&image, NULL, window ? box(window) : whole, display ? box(display) : whole, &part, &err))
        die("%s", err.text);
    for (i++; i < argc; i++)
        set(part, store, argv[i], -1, -1);
    for (size_t p = 0; p < poke_count; p++) {
        int x, y, n = 0;
        if (sscanf(pokes[p], "%d,%d,%n", &x, &y, &n) != 2 || !n)
            die("'%s' is not X,Y,CHANNEL=VALUE", pokes[p]);
        set(part, store, pokes[p] + n, x, y);
    }
    VolBytes bytes = {0};
    if (vol_exr_write(&image, VOL_EXR_ZIP, 1, &bytes, NULL, &err))
        die("%s", err.text);
    if (fwrite(bytes.data, 1, bytes.size, stdout) != bytes.size || fflush(stdout))
        die("cannot write");
    vol_bytes_free(&bytes);
    vol_image_free(&image);
    return 0;
}
