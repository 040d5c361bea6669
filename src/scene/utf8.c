// SPDX-License-Identifier: MIT
//
// Is the text UTF-8 (RFC 3629: no overlong forms, no surrogates), and free of NUL bytes and control
// characters? Checked before anything else reads it, so that later code may trust every byte. The
// rare line separators of Unicode are refused, because editors count lines without them.

#include "tree.h"

#include <string.h>

int nmm_utf8_decode(const char *bytes, size_t left, unsigned *code) {
    const unsigned char *text = (const unsigned char *)bytes;
    static const unsigned least[5] = {0, 0, 0x80, 0x800, 0x10000};
    const unsigned char c = text[0];
    const int n = c < 0x80 ? 1 : c < 0xc0 ? 0 : c < 0xe0 ? 2 : c < 0xf0 ? 3 : c < 0xf8 ? 4 : 0;
    if (n == 0 || (size_t)n > left) return 0;
    *code = n == 1 ? c : c & (0x7fu >> n);
    for (int i = 1; i < n; i++) {
        if ((text[i] & 0xc0) != 0x80) return 0;
        *code = (*code << 6) | (text[i] & 0x3fu);
    }
    const bool surrogate = *code >= 0xd800 && *code <= 0xdfff;
    return *code < least[n] || *code > 0x10ffff || surrogate ? 0 : n;
}

// What is wrong with a character; NULL: nothing.
static const char *fault_of(unsigned code) {
    if (code == 0) return "a NUL byte";
    if (code == 0x7f || (code < 0x20 && code != '\t' && code != '\n' && code != '\r'))
        return "a control character";
    if (code >= 0x80 && code < 0xa0) return "a control character";
    if (code == 0x2028 || code == 0x2029) return "a Unicode line separator";
    if (code == 0xfeff) return "a byte order mark in the middle of the text";
    if ((code & 0xfffe) == 0xfffe) return "a code that is no character";
    return NULL;
}

static nmm_status complain_byte(nmm_reader *reader, nmm_mark mark, unsigned byte) {
    const bool utf16 = mark.line == 1 && mark.column == 1 && byte >= 0xfe;
    return nmm_complain(reader, mark,
                        "the text is not UTF-8, found byte 0x%02x%s; save the file as UTF-8", byte,
                        utf16 ? " (it looks like UTF-16)" : "");
}

nmm_status nmm_utf8_check(nmm_reader *reader, const char *text, size_t length, nmm_mark start,
                          bool *clean) {
    const unsigned char *byte = (const unsigned char *)text;
    nmm_mark mark = start;
    *clean = false;
    // A byte order mark at the very start is fine.
    size_t i = length >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0 ? 3 : 0;
    while (i < length) {
        unsigned code = 0;
        const int n = nmm_utf8_decode(text + i, length - i, &code);
        if (n == 0) return complain_byte(reader, mark, byte[i]);
        const char *fault = fault_of(code);
        if (fault != NULL) {
            return nmm_complain(
                reader, mark, "the text holds %s (code 0x%02x); only text is allowed", fault, code);
        }
        i += (size_t)n;
        const bool pair = code == '\r' && i < length && text[i] == '\n';
        const bool ends = code == '\n' || (code == '\r' && !pair);
        mark.column = ends ? 1 : mark.column + 1;
        mark.line += ends ? 1 : 0;
    }
    *clean = true;
    return NMM_OK;
}
