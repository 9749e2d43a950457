/* DICOM slices for the tests of the importer, in explicit little endian, one file each. */
#ifndef TESTS_UNIT_DICOM_FILES_H
#define TESTS_UNIT_DICOM_FILES_H

#include <sys/stat.h>

#include "import_files.h"

__attribute__((unused)) static void put_tag(Block *b, uint32_t tag, const char *vr, const void *value, size_t size)
{
    bool wide = strcmp(vr, "OW") == 0 || strcmp(vr, "OB") == 0 || strcmp(vr, "SQ") == 0;
    put_int(b, tag >> 16, 2, false);
    put_int(b, tag & 0xffff, 2, false);
    put(b, vr, 2);
    if (wide)
        put_int(b, 0, 2, false);
    put_int(b, size + (size & 1), wide ? 4 : 2, false);
    put(b, value, size);
    if (size & 1)
        put(b, strcmp(vr, "UI") == 0 || strcmp(vr, "OB") == 0 ? "" : " ", 1);
}

__attribute__((unused)) static void put_tag_text(Block *b, uint32_t tag, const char *vr, const char *text)
{
    if (text)
        put_tag(b, tag, vr, text, strlen(text));
}

__attribute__((unused)) static void put_tag_short(Block *b, uint32_t tag, int value)
{
    Block v = {.size = 0};
    put_int(&v, (uint64_t)value, 2, false);
    put_tag(b, tag, "US", v.data, 2);
}

/* A sequence of one item that holds these elements. */
__attribute__((unused)) static void put_tag_sequence(Block *b, uint32_t tag, const Block *elements)
{
    Block item = {.size = 0};
    put_int(&item, 0xfffe, 2, false);
    put_int(&item, 0xe000, 2, false);
    put_int(&item, elements->size, 4, false);
    put(&item, elements->data, elements->size);
    put_tag(b, tag, "SQ", item.data, item.size);
}

/* An image of 2 x 1 samples of 16 bits at 0, 0, z; `more` are elements before the pixels. */
typedef struct Plane {
    const char *z;      /* NULL: no place */
    const char *number; /* Instance Number, NULL: none */
    const char *series;
    bool is_signed;
    int pixels[2];
    const Block *more;
} Plane;

__attribute__((unused)) static Block plane_file(const Plane *p)
{
    Block b = {.size = 128};
    char place[64];
    snprintf(place, sizeof place, "0\\0\\%s", p->z ? p->z : "");
    put_text(&b, "DICM");
    put_tag_text(&b, 0x00020010, "UI", "1.2.840.10008.1.2.1");
    put_tag_text(&b, 0x00080016, "UI", "1.2.840.10008.5.1.4.1.1.2");
    put_tag_text(&b, 0x0020000e, "UI", p->series ? p->series : "1.2.3");
    put_tag_text(&b, 0x00200013, "IS", p->number);
    put_tag_text(&b, 0x00200032, "DS", p->z ? place : NULL);
    put_tag_short(&b, 0x00280010, 1);
    put_tag_short(&b, 0x00280011, 2);
    put_tag_text(&b, 0x00280030, "DS", "1\\1");
    put_tag_short(&b, 0x00280100, 16);
    put_tag_short(&b, 0x00280101, 16);
    put_tag_short(&b, 0x00280102, 15);
    put_tag_short(&b, 0x00280103, p->is_signed);
    if (p->more)
        put(&b, p->more->data, p->more->size);
    Block pixels = {.size = 0};
    for (int i = 0; i < 2; i++)
        put_int(&pixels, (uint64_t)p->pixels[i], 2, false);
    put_tag(&b, 0x7fe00010, "OW", pixels.data, pixels.size);
    return b;
}

__attribute__((unused)) static void save_plane(const char *name, const Plane *p)
{
    static Block b;
    b = plane_file(p);
    save_block(name, &b);
}

__attribute__((unused)) static void make_inner_folder(const char *name)
{
    if (mkdir(path_of(name), 0777))
        FAIL("cannot make %s", path_of(name));
}

#endif
