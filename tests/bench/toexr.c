/* Pixels of other programs as EXR:  toexr WxH u8|f32 CHANNELS [flip] [straight] <PIXELS >IMAGE.exr
 *
 * CHANNELS are their one-letter names in the order of a pixel's numbers, as RGB or RGBA; bytes stand for 0 to 1.  Rows
 * begin at the top, with `flip` at the bottom; with
 * `straight` colours were not multiplied by opacity, A, and are here. */
#include "tests/tools/tool.h"

int main(int argc, char **argv)
{
    unsigned width = 0, height = 0;
    bool flip = false, straight = false, well = argc >= 4 && sscanf(argv[1], "%ux%u", &width, &height) == 2;
    for (int i = 4; i < argc; i++) {
        flip = flip || strcmp(argv[i], "flip") == 0;
        straight = straight || strcmp(argv[i], "straight") == 0;
        well = well && (strcmp(argv[i], "flip") == 0 || strcmp(argv[i], "straight") == 0);
    }
    if (!well || width == 0 || height == 0 || width > 16384 || height > 16384 || (straight && !strchr(argv[3], 'A')))
        die("usage: toexr WxH u8|f32 CHANNELS [flip] [straight]");
    bool bytes = strcmp(argv[2], "u8") == 0;
    size_t channels = strlen(argv[3]), row_size = channels * width * (bytes ? 1 : sizeof(float));
    VolError err = {""};
    VolImage image = {0};
    VolPart *part = NULL;
    VolBox2 box = {0, 0, (int)width - 1, (int)height - 1};
    if (vol_image_add_part(&image, NULL, box, box, &part, &err) != VOL_OK)
        die("%s", err.text);
    for (size_t c = 0; c < channels; c++) {
        char name[2] = {argv[3][c], '\0'};
        VolChannel *channel = NULL;
        if (vol_part_add_channel(part, name, VOL_PIXEL_FLOAT, &channel, &err) != VOL_OK)
            die("%s", err.text);
    }
    unsigned char *row = calloc(1, row_size);
    if (!row)
        die("out of memory");
    for (size_t y = 0; y < height; y++) {
        if (fread(row, 1, row_size, stdin) != row_size)
            die("fewer pixels than %s", argv[1]);
        for (size_t c = 0; c < channels; c++) {
            char name[2] = {argv[3][c], '\0'};
            float *to = vol_part_channel(part, name)->data + (flip ? height - 1 - y : y) * width;
            for (size_t x = 0; x < width; x++) {
                size_t i = x * channels + c;
                to[x] = (float)row[bytes ? i : 0] / 255;
                if (!bytes)
                    memcpy(&to[x], row + i * sizeof(float), sizeof(float));
            }
        }
    }
    VolChannel *alpha = straight ? vol_part_channel(part, "A") : NULL;
    for (size_t c = 0; alpha && c < part->channel_count; c++)
        for (size_t i = 0; &part->channels[c] != alpha && i < (size_t)width * height; i++)
            part->channels[c].data[i] *= alpha->data[i];
    VolBytes out = {0};
    if (vol_exr_write(&image, VOL_EXR_ZIP, 1, &out, NULL, &err) != VOL_OK)
        die("%s", err.text);
    if (fwrite(out.data, 1, out.size, stdout) != out.size || fflush(stdout))
        die("cannot write");
    vol_bytes_free(&out);
    vol_image_free(&image);
    free(row);
    return 0;
}
