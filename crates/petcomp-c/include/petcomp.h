/* petcomp for C. Made by cbindgen from crates/petcomp-c; docs/c.md has an example. */

#ifndef PETCOMP_H
#define PETCOMP_H

#include <stddef.h>
#include <stdint.h>

// What a call came to. petcomp_error_message() says the rest.
typedef enum {
  // It is done.
  PETCOMP_STATUS_OK = 0,
  // A pointer, size or text that cannot be right.
  PETCOMP_STATUS_BAD_ARGUMENT = 1,
  // A buffer that is too small; nothing was written to it.
  PETCOMP_STATUS_BUFFER_TOO_SMALL = 2,
  // A pipeline or sample that was closed, or never was one.
  PETCOMP_STATUS_CLOSED = 3,
  // A file that cannot be read or understood.
  PETCOMP_STATUS_FILE = 4,
  // A value in a document that cannot be right.
  PETCOMP_STATUS_FIELD = 5,
  // A value of an option that cannot be right.
  PETCOMP_STATUS_VALUE = 6,
  // A photo in which no usable object was found.
  PETCOMP_STATUS_PHOTO = 7,
  // Corners that no camera can have seen.
  PETCOMP_STATUS_CAMERA = 8,
  // Objects that would not come to rest.
  PETCOMP_STATUS_UNSETTLED = 9,
  // A bug in petcomp: please report it.
  PETCOMP_STATUS_INTERNAL = 10,
} petcomp_status;

// A pinhole camera without distortion, with OpenCV's axes: x right, y down, z forward.
typedef struct {
  // Focal lengths along x and y, pixels.
  double focal_px[2];
  // Where the optical axis meets the picture, pixels; (0, 0) is the upper left corner of the
  // upper left pixel.
  double principal_px[2];
  // Three rows of rotation and translation (metres): camera point = matrix * (world point, 1).
  double camera_from_world[3][4];
} petcomp_camera;

// A recipe with its assets and photos, opened once. 0 is none.
typedef struct {
  // Never used twice.
  uint64_t id;
} petcomp_pipeline;

// A picture and its labels. 0 is none.
typedef struct {
  // Never used twice.
  uint64_t id;
} petcomp_sample;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Solves the camera that sees a rectangle of known size at four corners.
//
// `corners_px`: eight numbers, x and y of top left, top right, bottom right and bottom left, pixels.
// `size_m`: width and height of the rectangle, metres. `image`: width and height of the picture,
// pixels. `focal_px`: the focal length where it is known, otherwise 0. The rectangle becomes the
// world's plane z = 0, centred, +x along its width, +z towards the camera.
//
// `report`, where it is not null, gets the text of petcomp's NAME.camera.json: the camera, standard
// deviations of all that was solved, warnings. `report_length`, where it is not null, gets the bytes
// that the text takes with its NUL. With too small a buffer for it `camera` is still written.
//
// # Safety
// Each pointer is null or points to what is said here; `report` has room for `report_capacity` bytes.
petcomp_status petcomp_camera_solve(const double *corners_px,
                                    const double *size_m,
                                    const uint32_t *image,
                                    double focal_px,
                                    petcomp_camera *camera,
                                    char *report,
                                    size_t report_capacity,
                                    size_t *report_length);

// Keys a picture as Blender's Keying node does, to the bit.
//
// `rgba`: `height` rows of `width` pixels of four floats, scene-linear (Rec. 709 primaries), alpha
// premultiplied; from row to row it is `row_stride` floats, at least 4 * `width`. Rows without a gap
// are read where they are. `screen`: the colour of the screen, three scene-linear floats.
// `options`: a JSON object with Blender's settings, as {"profile": "blender-4.5", "clip_black":
// 0.1}, or null for the defaults.
//
// `matte` gets `width` * `height` floats, 0 to 1; `cutout` four times as many, scene-linear,
// premultiplied, its rows without gaps. Each of them may be null.
//
// # Safety
// Each pointer is null or points to what is said here.
petcomp_status petcomp_key(const float *rgba,
                           size_t width,
                           size_t height,
                           size_t row_stride,
                           const float *screen,
                           const char *options,
                           float *matte,
                           float *cutout);

// Opens a recipe file, the assets and the photos that it names.
//
// `overrides`: `override_count` texts as `scene.objects=[5,15]`, which change values of the recipe;
// null where there are none. `pipeline` gets the handle, to be closed by petcomp_pipeline_close().
//
// # Safety
// Each pointer is null or points to what is said here; texts end with a NUL.
petcomp_status petcomp_pipeline_open(const char *recipe,
                                     const char *const *overrides,
                                     size_t override_count,
                                     petcomp_pipeline *pipeline);

// Closes a pipeline. Its samples stay.
petcomp_status petcomp_pipeline_close(petcomp_pipeline pipeline);

// Makes sample `k` of a pipeline: the picture that `petcomp dataset generate --seed SEED` writes
// under that number, whatever was made before.
//
// `sample` gets the handle, to be given back by petcomp_sample_free(). Several threads may make
// samples at once; each call also works on all cores by itself (RAYON_NUM_THREADS).
//
// # Safety
// Each pointer is null or points to what is said here.
petcomp_status petcomp_sample_make(petcomp_pipeline pipeline,
                                   uint64_t seed,
                                   uint64_t k,
                                   petcomp_sample *sample);

// Width and height of a sample, pixels.
//
// # Safety
// `width` and `height` are null or can be written to.
petcomp_status petcomp_sample_size(petcomp_sample sample, size_t *width, size_t *height);

// The picture as a display shows it, with what a JPEG loses where the recipe writes those: rows
// without gaps, three bytes a pixel, sRGB. `capacity` is in bytes, at least 3 * width * height.
//
// # Safety
// `rgb` is null or has room for `capacity` bytes.
petcomp_status petcomp_sample_srgb8(petcomp_sample sample, uint8_t *rgb, size_t capacity);

// The picture in scene-linear light (Rec. 709 primaries): rows without gaps, four floats a pixel,
// alpha premultiplied. `capacity` is in floats, at least 4 * width * height.
//
// # Safety
// `rgba` is null or has room for `capacity` floats.
petcomp_status petcomp_sample_linear(petcomp_sample sample, float *rgba, size_t capacity);

// The labels as JSON: {"width", "height", "classes": names, "objects": [{"id", "class": place in
// the names, "ignored", "box": [left, top, right, bottom] in pixels, "visible_fraction": share that is
// seen, "mask": COCO's compressed run lengths}]}, as the recipe's [labels] want them.
//
// `length`, where it is not null, gets the bytes that the text takes with its NUL; with too small a
// buffer nothing else is written.
//
// # Safety
// `json` is null or has room for `capacity` bytes.
petcomp_status petcomp_sample_labels(petcomp_sample sample, char *json, size_t capacity, size_t *length);

// Gives a sample's memory back.
petcomp_status petcomp_sample_free(petcomp_sample sample);

// What went wrong in this thread's last call, one line of UTF-8: the place, the value, what was
// expected. Empty after a call that went well. It stays until the thread's next call.
const char *petcomp_error_message(void);

// The version of the library, as "0.1.0". It stays as long as the process.
const char *petcomp_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PETCOMP_H */
