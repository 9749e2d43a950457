/* How library code says something without printing: the caller hands in a VolLog whose `say` decides.
 * A NULL log, or one without `say`, is silence. */
#ifndef VOL_BASE_LOG_H
#define VOL_BASE_LOG_H

typedef enum VolSeverity { VOL_NOTE, VOL_WARNING } VolSeverity;

typedef struct VolLog {
    void (*say)(void *user, VolSeverity severity, const char *line);
    void *user;
} VolLog;

void vol_warn(const VolLog *log, const char *format, ...) __attribute__((format(printf, 2, 3)));
void vol_note(const VolLog *log, const char *format, ...) __attribute__((format(printf, 2, 3)));

#endif
