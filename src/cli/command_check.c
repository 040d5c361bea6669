// SPDX-License-Identifier: MIT
//
// nmm check: everything up to the first step, nothing written.

#include "json.h"
#include "message.h"
#include "options.h"
#include "scene_open.h"

#include <stdio.h>
#include <string.h>

static void print_check(nmm_sim *sim, const char *path, const nmm_check *c) {
    const char *title = nmm_sim_title(sim), *choices = nmm_sim_choices(sim);
    printf("%s: %s\n", is_standard_input(path) ? "<stdin>" : path,
           title && *title ? title : "no title");
    printf("  %d blocks, %d elements, %d covers, %d unknowns\n", c->blocks, c->elements, c->covers,
           c->unknowns);
    printf("  %d contacts in the first configuration\n", c->contacts);
    if (c->whole_blocks)
        printf("  one cover for each block; ");
    else
        printf("  covers of %.4g m; ", c->cover_size);
    printf("elements of %.4g m2 in the mean, %.3g m2 the smallest; %.6g m2 in all\n", c->mean_area,
           c->smallest_area, c->area);
    printf("  about %.1f MB of memory\n", c->memory_bytes / 1e6);
    if (choices && *choices) printf("\nChosen, on and off\n%s", choices);
}

/// An item for each line.
static void json_lines(json *out, const char *text) {
    char line[1024];
    while (text && *text) {
        const size_t length = strcspn(text, "\n");
        snprintf(line, sizeof line, "%.*s", (int)length, text);
        if (length) json_text(out, NULL, line);
        text += length + (text[length] == '\n');
    }
}

static void json_check(nmm_sim *sim, const char *path, const nmm_check *c) {
    json out = {.file = stdout};
    char warning[MOST_WARNINGS][WARNING_LENGTH];
    const int n = scene_warnings(c, warning);
    json_open(&out, NULL);
    json_text(&out, "scene", path);
    json_text(&out, "title", nmm_sim_title(sim));
    json_integer(&out, "blocks", c->blocks);
    json_integer(&out, "elements", c->elements);
    json_integer(&out, "covers", c->covers);
    json_integer(&out, "unknowns", c->unknowns);
    json_integer(&out, "points", c->points);
    json_integer(&out, "vertices", c->vertices);
    json_integer(&out, "contacts", c->contacts);
    json_integer(&out, "trimmed_joint_ends", c->trimmed);
    json_number(&out, "trimmed_length", c->trimmed_length);
    json_integer(&out, "joints_outside", c->joints_outside);
    json_number(&out, "area", c->area);
    json_number(&out, "mean_element_area", c->mean_area);
    json_number(&out, "smallest_element_area", c->smallest_area);
    json_number(&out, "cover_size", c->cover_size);
    json_number(&out, "memory_bytes", c->memory_bytes);
    json_number(&out, "end_time", nmm_sim_end_time(sim));
    json_open_array(&out, "choices");
    json_lines(&out, nmm_sim_choices(sim));
    json_close_array(&out);
    json_open_array(&out, "warnings");
    json_lines(&out, nmm_sim_warnings(sim));
    for (int i = 0; i < n; i++)
        json_text(&out, NULL, warning[i]);
    json_close_array(&out);
    json_close(&out);
}

static void show_check(nmm_sim *sim, const arguments *given, const nmm_check *check) {
    char warning[MOST_WARNINGS][WARNING_LENGTH];
    if (given->json) {
        json_check(sim, given->path, check);
        return;
    }
    if (!given->quiet) print_check(sim, given->path, check);
    const int n = scene_warnings(check, warning);
    fflush(stdout);
    fputs(nmm_sim_warnings(sim), stderr);
    for (int i = 0; i < n; i++)
        message_warning("%s", warning[i]);
}

int command_check(const arguments *given) {
    nmm_sim *sim = NULL;
    nmm_check check;
    int status = scene_open(&sim, given);
    if (status == EXIT_DONE && nmm_sim_check(sim, &check) != NMM_OK)
        status = message_failure(nmm_sim_error(sim), given->path);
    if (status == EXIT_DONE) show_check(sim, given, &check);
    nmm_sim_destroy(sim);
    return status;
}
