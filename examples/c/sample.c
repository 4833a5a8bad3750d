/* Keys a pixel, solves a camera, and writes a labelled sample of a recipe:
 *
 *     cc sample.c $(pkg-config --cflags --libs petcomp) -o sample
 *     ./sample recipe.toml 0 7 picture.ppm labels.json
 */
#include <petcomp.h>
#include <stdio.h>
#include <stdlib.h>

/* Exits if a call failed. */
static void check(petcomp_status status)
{
    if (status != PETCOMP_STATUS_OK) {
        fprintf(stderr, "error %d: %s\n", (int)status, petcomp_error_message());
        exit(1);
    }
}

/* What petcomp notes on its way, such as a photo that is not used. */
static void print_message(petcomp_log_level level, const char *message)
{
    if (level <= PETCOMP_LOG_LEVEL_WARNING)
        fprintf(stderr, "%s: %s\n", level == PETCOMP_LOG_LEVEL_ERROR ? "error" : "warning", message);
}

static void *memory(size_t bytes)
{
    void *place = malloc(bytes);
    if (place == NULL)
        exit(2);
    return place;
}

static void write_file(const char *path, const char *head, const void *bytes, size_t count)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL || fputs(head, file) < 0 || fwrite(bytes, 1, count, file) != count || fclose(file) != 0)
        exit(3);
}

/* 30 % grey film over a green screen. */
static void key_a_pixel(void)
{
    const float pixel[4] = {0.22f, 0.71f, 0.22f, 1.0f}, screen[3] = {0.1f, 0.8f, 0.1f};
    float matte, cutout[4];
    check(petcomp_key(pixel, 1, 1, 4, screen, "{\"profile\": \"blender-4.5\"}", &matte, cutout));
    printf("matte %.6f\n", matte);
}

/* A 0.56 x 0.37 m tray in a 1280 x 853 pixel photo. */
static void solve_a_camera(void)
{
    const double corners[8] = {236, 239, 1020, 216, 1009, 701, 276, 739}, size[2] = {0.56, 0.37};
    const uint32_t image[2] = {1280, 853};
    petcomp_camera camera;
    check(petcomp_camera_solve(corners, size, image, 0.0, &camera, NULL, 0, NULL));
    printf("focal length %.3f pixels\n", camera.focal_px[0]);
}

static void write_picture(petcomp_sample sample, const char *path)
{
    size_t width, height;
    char head[64];
    check(petcomp_sample_size(sample, &width, &height));
    unsigned char *rgb = memory(3 * width * height);
    check(petcomp_sample_srgb8(sample, rgb, 3 * width * height));
    snprintf(head, sizeof head, "P6\n%zu %zu\n255\n", width, height);
    write_file(path, head, rgb, 3 * width * height);
    free(rgb);
}

/* The first call only queries the length of the text. */
static void write_labels(petcomp_sample sample, const char *path)
{
    size_t length = 0;
    if (petcomp_sample_labels(sample, NULL, 0, &length) != PETCOMP_STATUS_BUFFER_TOO_SMALL)
        exit(4);
    char *json = memory(length);
    check(petcomp_sample_labels(sample, json, length, NULL));
    write_file(path, json, "\n", 1);
    free(json);
}

int main(int count, char **words)
{
    petcomp_pipeline pipeline;
    petcomp_sample sample;
    if (count != 6)
        return 5;
    check(petcomp_log_to(print_message));
    printf("petcomp %s\n", petcomp_version());
    key_a_pixel();
    solve_a_camera();
    check(petcomp_pipeline_open(words[1], NULL, 0, &pipeline));
    check(petcomp_sample_make(pipeline, strtoull(words[2], NULL, 10), strtoull(words[3], NULL, 10), &sample));
    check(petcomp_pipeline_close(pipeline));
    write_picture(sample, words[4]);
    write_labels(sample, words[5]);
    check(petcomp_sample_free(sample));
    return petcomp_sample_free(sample) == PETCOMP_STATUS_CLOSED ? 0 : 6;
}
