/* DICOM with a modality LUT: a table takes the place of slope and intercept. */
#include "dicom_files.h"

typedef struct Table {
    int entries, first, bits;
    const char *vr; /* of the descriptor */
    bool wide;      /* entries of 16 bits */
    const int *data;
    int count;      /* of what there is */
} Table;

static const int tenfold[] = {10, 20, 30, 40, 250};

static Block table_item(const Table *t)
{
    Block item = {.size = 0}, values = {.size = 0};
    if (t->vr) {
        put_int(&values, (uint64_t)t->entries, 2, false);
        put_int(&values, (uint64_t)t->first, 2, false);
        put_int(&values, (uint64_t)t->bits, 2, false);
        put_tag(&item, 0x00283002, t->vr, values.data, 6);
    }
    put_tag_text(&item, 0x00283004, "LO", "HU");
    values.size = 0;
    for (int i = 0; t->data && i < t->count; i++)
        put_int(&values, (uint64_t)t->data[i], t->wide ? 2 : 1, false);
    if (t->data)
        put_tag(&item, 0x00283006, t->wide ? "US" : "OW", values.data, values.size);
    return item;
}

/* Pixels of the two values with the table, and a slope that does not count. */
static void save_table(const char *name, const Table *t, int left, int right)
{
    Block item = table_item(t), more = {.size = 0};
    put_tag_text(&more, 0x00281052, "DS", "7");
    put_tag_text(&more, 0x00281053, "DS", "9");
    put_tag_sequence(&more, 0x00283000, &item);
    save_plane(name, &(Plane){.z = "1", .is_signed = t->first < 0, .pixels = {left, right}, .more = &more});
}

static void check_table(const Table *t, int left, int right, double mapped, double mapped_right)
{
    save_table("table", t, left, right);
    check_import("table", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){mapped, mapped_right});
}

static void check_no_table(const Table *t, const char *text)
{
    save_table("table", t, 0, 1);
    check_refused("table", NULL, text);
}

static void test_values(void)
{
    Table t = {.entries = 5, .first = 100, .bits = 16, .vr = "US", .wide = true, .data = tenfold, .count = 5};
    check_table(&t, 100, 103, 10, 40);
    check_table(&t, 0, 99, 10, 10); /* below the first, beyond the last */
    check_table(&t, 104, 65535, 250, 250);
    t.first = -2;
    t.vr = "SS";
    check_table(&t, -2, 1, 10, 40);
    check_table(&t, -32768, 32767, 10, 250);
    t.vr = "US"; /* pixels with a sign have a first value with one */
    check_table(&t, -1, 0, 20, 30);
    t.bits = 12;
    check_table(&t, -1, 0, 20, 30);
}

static void test_bytes(void)
{
    Table t = {.entries = 5, .first = 1, .bits = 8, .vr = "US", .data = tenfold, .count = 5};
    check_table(&t, 1, 5, 10, 250);
    check_table(&t, 2, 3, 20, 30);
    t.wide = true; /* each in a word of its own */
    check_table(&t, 1, 5, 10, 250);
    check_table(&t, 2, 3, 20, 30);
}

/* 0 stands for 65536, which only bytes have room for here. */
static void test_largest(void)
{
    static Block b;
    static unsigned char entries[65536];
    for (size_t i = 0; i < sizeof entries; i++)
        entries[i] = (unsigned char)(i / 256);
    const Table empty = {.entries = 0, .first = 0, .bits = 8, .vr = "US"};
    Block item = table_item(&empty);
    b = plane_file(&(Plane){.z = "1", .pixels = {0x1234, 0xffff}});
    static unsigned char whole[70000];
    size_t at = b.size - 16, size = at;
    memcpy(whole, b.data, at);
    Block head = {.size = 0};
    put_int(&head, 0x30000028, 4, false);
    put(&head, "SQ\0", 4);
    put_int(&head, 8 + item.size + 12 + sizeof entries, 4, false);
    put_int(&head, 0xe000fffe, 4, false);
    put_int(&head, item.size + 12 + sizeof entries, 4, false);
    put(&head, item.data, item.size);
    put_int(&head, 0x30060028, 4, false);
    put(&head, "OW\0", 4);
    put_int(&head, sizeof entries, 4, false);
    memcpy(whole + size, head.data, head.size), size += head.size;
    memcpy(whole + size, entries, sizeof entries), size += sizeof entries;
    memcpy(whole + size, b.data + at, 16), size += 16;
    save("large", whole, size);
    check_import("large", NULL, VOL_STORE_FLOAT, (int32_t[]){2, 1, 1}, NULL, (double[]){0x12, 0xff});
}

static void test_refused(void)
{
    const Table good = {.entries = 5, .first = 0, .bits = 16, .vr = "US", .wide = true, .data = tenfold, .count = 5};
    Table t = good;
    t.count = 4;
    check_no_table(&t, "its modality LUT has 8 bytes, not the 10 of 5 entries of 16 bits");
    t = good;
    t.entries = 0;
    check_no_table(&t, "65536 entries");
    t = good;
    t.bits = 32;
    check_no_table(&t, "modality LUT of 32 bits");
    t.bits = 0;
    check_no_table(&t, "modality LUT of 0 bits");
    t = good;
    t.vr = NULL;
    check_no_table(&t, "modality LUT without");
    t = good;
    t.data = NULL;
    check_no_table(&t, "its modality LUT has 0 bytes");
}

static void test_damage(void)
{
    const Table t = {.entries = 5, .first = 0, .bits = 16, .vr = "US", .wide = true, .data = tenfold, .count = 5};
    Block item = table_item(&t), more = {.size = 0}, b;
    put_tag_sequence(&more, 0x00283000, &item);
    b = plane_file(&(Plane){.z = "1", .pixels = {3, 4}, .more = &more});
    check_cuts("cut", NULL, &b, b.size);
    check_damage(NULL, &b, 3000);
}

int main(void)
{
    make_folder();
    RUN(test_values);
    RUN(test_bytes);
    RUN(test_largest);
    RUN(test_refused);
    RUN(test_damage);
    remove_folder();
    return test_end();
}
