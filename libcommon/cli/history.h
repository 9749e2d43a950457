/* Provenance that travels in outputs: `vol:history` (the command lines that made a file, oldest first, inputs of a merge
 * indented by a tab), `vol:argsHash` (hash of effective options, inputs' content hashes and version). */
#ifndef VOL_CLI_HISTORY_H
#define VOL_CLI_HISTORY_H

#include "base/mem.h"
#include "cli/opt.h"

#define VOL_VERSION "0.1.0"

/* One line: the program and its options, long form, quoted as a shell needs them.  Options that cannot change the output
 * are left out (-o -f -n -q -v -j --cpu --progress --stats --no-history), values of --set too (they may be secret; the
 * key stays), and /dev/fd/N is written as "-", so that pipes and files, threads and cpu levels give the same bytes.
 * Operands appear only `with_operands`: where they name inputs, a pipe has none.  Allocated; NULL: out of memory. */
char *vol_history_line(const char *program, const VolCommandLine *line, bool with_operands);

/* The same without the names of inputs that options have: a copy is the same input. */
char *vol_hashed_line(const char *program, const VolCommandLine *line, bool with_operands);

/* prior (may be NULL or "") + newline + line.  Allocated; NULL: out of memory. */
char *vol_history_append(const char *prior, const char *line);

/* Hash of program, version, that line and the inputs' bytes' hashes (and what else is taken of them), as 32 hex digits. */
void vol_args_hash(const char *hashed_line, const uint64_t (*input_digests)[2], size_t inputs, char out[33]);

#endif
