/* Looks into a JSON file:  json FILE [KEY...]   prints the value found by going down the keys (array indices are
 * numbers); exit 1 where there is none, 3 where the file is not JSON.  Without keys: only whether it is JSON. */
#include "tool.h"

int main(int argc, char **argv)
{
    if (argc < 2)
        die("usage: json FILE [KEY...]");
    json_error_t error;
    json_t *json = json_load_file(argv[1], JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
    if (!json) {
        fprintf(stderr, "json: %s:%d: %s\n", argv[1], error.line, error.text);
        return 3;
    }
    const json_t *at = json;
    for (int i = 2; at && i < argc; i++)
        at = json_is_array(at) ? json_array_get(at, strtoul(argv[i], NULL, 10)) : json_object_get(at, argv[i]);
    if (!at)
        return 1;
    if (json_is_string(at))
        printf("%s\n", json_string_value(at));
    else if (argc > 2) {
        json_dumpf(at, stdout, JSON_ENCODE_ANY | JSON_REAL_PRECISION(17) | JSON_COMPACT);
        printf("\n");
    }
    json_decref(json);
    return 0;
}
