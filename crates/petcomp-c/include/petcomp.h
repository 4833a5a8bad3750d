/* petcomp for C. Made by cbindgen from crates/petcomp-c; docs/c.md has an example. */

#ifndef PETCOMP_H
#define PETCOMP_H

#include <stddef.h>
#include <stdint.h>

// Result of a call. petcomp_error_message() describes an error.
typedef enum {
  // Success.
  PETCOMP_STATUS_OK = 0,
  // An invalid pointer, size or text.
  PETCOMP_STATUS_BAD_ARGUMENT = 1,
  // A buffer is too small; nothing was written to it.
  PETCOMP_STATUS_BUFFER_TOO_SMALL = 2,
  // A pipeline or sample that was closed or never existed.
  PETCOMP_STATUS_CLOSED = 3,
  // A file that cannot be read or parsed.
  PETCOMP_STATUS_FILE = 4,
  // An invalid value in a document.
  PETCOMP_STATUS_FIELD = 5,
  // An invalid value of an option.
  PETCOMP_STATUS_VALUE = 6,
  // A photo without a usable object.
  PETCOMP_STATUS_PHOTO = 7,
  // Corners that no camera can have seen.
  PETCOMP_STATUS_CAMERA = 8,
  // Objects that did not come to rest.
  PETCOMP_STATUS_UNSETTLED = 9,
  // A bug in petcomp: please report it.
  PETCOMP_STATUS_INTERNAL = 10,
} petcomp_status;

// How serious a message is.
typedef enum {
  // Something failed.
  PETCOMP_LOG_LEVEL_ERROR = 1,
  // Something to look at, such as a photo that is not used.
  PETCOMP_LOG_LEVEL_WARNING = 2,
  // Something to know.
  PETCOMP_LOG_LEVEL_INFO = 3,
} petcomp_log_level;

// A pinhole camera without distortion, with OpenCV's axes: x right, y down, z forward.
typedef struct {
  // Focal lengths along x and y, pixels.
  double focal_px[2];
  // Principal point, pixels; (0, 0) is the top left corner of the top left pixel.
  double principal_px[2];
  // Three rows of rotation and translation (metres): camera point = matrix * (world point, 1).
  double camera_from_world[3][4];
} petcomp_camera;

// Receives a message, one line of UTF-8 that is valid until the function returns.
typedef void (*petcomp_log_function)(petcomp_log_level level, const char *message);

// An open recipe with its assets and photos. 0 is no pipeline.
typedef struct {
  // Never reused.
  uint64_t id;
} petcomp_pipeline;

// An image and its labels. 0 is no sample.
typedef struct {
  // Never reused.
  uint64_t id;
} petcomp_sample;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Solves the camera from the four corners of a rectangle of known size.
//
// * `corners_px`: eight numbers, x and y of top left, top right, bottom right and bottom left,
//   pixels
// * `size_m`: width and height of the rectangle, metres
// * `image`: width and height of the image, pixels
// * `focal_px`: focal length, or 0 if unknown
// * `camera`: receives the camera. The rectangle becomes the world plane z = 0, centred, +x along
//   its width, +z towards the camera
// * `report`: if not null, receives the text of petcomp's NAME.camera.json: the camera, standard
//   deviations of everything solved, warnings. If the buffer is too small, `camera` is still
//   written
// * `report_length`: if not null, receives the size of that text in bytes, including its NUL
//
// # Safety
// Each pointer is null or points to memory as described; `report` has room for `report_capacity`
// bytes.
petcomp_status petcomp_camera_solve(const double *corners_px,
                                    const double *size_m,
                                    const uint32_t *image,
                                    double focal_px,
                                    petcomp_camera *camera,
                                    char *report,
                                    size_t report_capacity,
                                    size_t *report_length);

// Keys an image exactly like Blender's Keying node, bit for bit.
//
// * `rgba`: `height` rows of `width` pixels of four floats, scene-linear (Rec. 709 primaries),
//   alpha premultiplied; rows without gaps are read in place
// * `row_stride`: distance between rows in floats, at least 4 * `width`
// * `screen`: colour of the screen, three scene-linear floats
// * `options`: JSON object with Blender's settings, e.g. {"profile": "blender-4.5", "clip_black":
//   0.1}, or null for the defaults
// * `matte`: null, or receives `width` * `height` floats, 0 to 1
// * `cutout`: null, or receives four times as many, scene-linear, premultiplied, rows without gaps
//
// # Safety
// Each pointer is null or points to memory as described.
petcomp_status petcomp_key(const float *rgba,
                           size_t width,
                           size_t height,
                           size_t row_stride,
                           const float *screen,
                           const char *options,
                           float *matte,
                           float *cutout);

// Sets the function that receives the library's messages, or ends them if null, as at first.
//
// # Safety
// `function` is null or may be called from any thread, several at once, until it is replaced and
// the calls of petcomp that run meanwhile have returned. It must not throw.
petcomp_status petcomp_log_to(petcomp_log_function function);

// Opens a recipe file and the assets and photos that it names.
//
// * `overrides`: `override_count` strings that change values of the recipe, e.g.
//   `scene.objects=[5,15]`; may be null if there are none
// * `pipeline`: receives the handle; close it with petcomp_pipeline_close()
//
// # Safety
// Each pointer is null or points to memory as described; strings end with a NUL.
petcomp_status petcomp_pipeline_open(const char *recipe,
                                     const char *const *overrides,
                                     size_t override_count,
                                     petcomp_pipeline *pipeline);

// Closes a pipeline. Its samples remain valid.
petcomp_status petcomp_pipeline_close(petcomp_pipeline pipeline);

// Makes sample `k` of a pipeline: the image that `petcomp dataset generate --seed SEED` writes
// under that number, regardless of other samples made before.
//
// `sample` receives the handle; free it with petcomp_sample_free(). Several threads may make
// samples at once; each call uses all cores (RAYON_NUM_THREADS sets how many).
//
// # Safety
// Each pointer is null or points to memory as described.
petcomp_status petcomp_sample_make(petcomp_pipeline pipeline,
                                   uint64_t seed,
                                   uint64_t k,
                                   petcomp_sample *sample);

// Width and height of a sample, pixels.
//
// # Safety
// `width` and `height` are null or writable.
petcomp_status petcomp_sample_size(petcomp_sample sample, size_t *width, size_t *height);

// Copies the image for display, with JPEG's losses if the recipe writes JPEG: rows without gaps,
// three bytes per pixel, sRGB. `capacity` is in bytes, at least 3 * width * height.
//
// # Safety
// `rgb` is null or has room for `capacity` bytes.
petcomp_status petcomp_sample_srgb8(petcomp_sample sample, uint8_t *rgb, size_t capacity);

// Copies the image in scene-linear light (Rec. 709 primaries): rows without gaps, four floats per
// pixel, alpha premultiplied. `capacity` is in floats, at least 4 * width * height.
//
// # Safety
// `rgba` is null or has room for `capacity` floats.
petcomp_status petcomp_sample_linear(petcomp_sample sample, float *rgba, size_t capacity);

// Copies the labels as JSON, made according to the recipe's table `labels`: {"width", "height",
// "classes": names, "objects": [{"id", "class": index into the names, "ignored", "box": [left,
// top, right, bottom] in pixels, "visible_fraction": visible share, "mask": COCO's compressed
// RLE}]}.
//
// `length`, if not null, receives the size of the text in bytes, including its NUL. If the buffer
// is too small, nothing else is written.
//
// # Safety
// `json` is null or has room for `capacity` bytes.
petcomp_status petcomp_sample_labels(petcomp_sample sample, char *json, size_t capacity, size_t *length);

// Frees a sample.
petcomp_status petcomp_sample_free(petcomp_sample sample);

// The error of this thread's last call, one line of UTF-8: the place, the value, what was
// expected. Empty after success. The text is valid until the thread's next call.
const char *petcomp_error_message(void);

// The version of the library, e.g. "0.1.0". The text is valid as long as the process.
const char *petcomp_version(void);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* PETCOMP_H */
