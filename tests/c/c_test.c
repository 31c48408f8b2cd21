/* The C interface from C11: images, operations, errors, callbacks, files, threads.   c_test ROWS FOLDER
   ROWS is what rows.cc printed: every operation has to give the bits that it gives through C++. */
#include "tessera/c.h"

#include <math.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "c/check.h"
#include "tessera/version.h"

enum { kWidth = 24, kHeight = 16, kChannels = 4 };
typedef float picture[kHeight][kWidth][kChannels];

static void fill(picture p, int k) {
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < kChannels; ++c)
        p[y][x][c] = (float)((7 * x + 13 * y + 5 * c + 11 * k + x * y) % 32) / 32;
    }
  }
}

static tessera_pixels pixels_of(void* data, int width, int height, int channels) {
  tessera_pixels p = TESSERA_INIT(tessera_pixels);
  p.data = data;
  p.window.x1 = width, p.window.y1 = height;
  p.channels = channels;
  p.type = TESSERA_FLOAT;
  return p;
}

static tessera_image* image_of(int k) {
  picture data;
  fill(data, k);
  const tessera_pixels p = pixels_of(data, kWidth, kHeight, kChannels);
  tessera_image* image = NULL;
  SUCCEEDS(tessera_image_copy(&p, NULL, &image, &error));
  return image;
}

static tessera_parameters* parameters_of(const char* operation, const char* line) {
  tessera_parameters* parameters = NULL;
  SUCCEEDS(tessera_parameters_new(operation, &parameters, &error));
  SUCCEEDS(tessera_parameters_parse(parameters, line, &error));
  return parameters;
}

static tessera_image* applied(const char* operation, const char* line, const tessera_image* to) {
  tessera_parameters* const parameters = parameters_of(operation, line);
  tessera_image* result = NULL;
  SUCCEEDS(tessera_apply(parameters, &to, 1, &result, &error));
  tessera_parameters_free(parameters);
  return result;
}

static void test_versions(void) {
  CHECK(tessera_c_version() == TESSERA_C_VERSION);
  CHECK(strcmp(tessera_version(), TESSERA_VERSION_STRING) == 0);
  CHECK(TESSERA_VERSION ==
        TESSERA_VERSION_MAJOR * 10000 + TESSERA_VERSION_MINOR * 100 + TESSERA_VERSION_PATCH);
}

static void test_registry(void) {
  const size_t count = tessera_operation_count();
  CHECK(count > 100);
  CHECK(tessera_operation_at(count) == NULL);
  CHECK(tessera_operation_find("colorconvert") != NULL); /* of a component */
  CHECK(tessera_operation_find("nothing") == NULL && tessera_operation_find(NULL) == NULL);
  for (size_t i = 0; i < count; ++i) {
    const tessera_operation* const operation = tessera_operation_at(i);
    tessera_operation_info info = TESSERA_INIT(tessera_operation_info);
    SUCCEEDS(tessera_operation_get_info(operation, &info, &error));
    CHECK(info.struct_size == sizeof info);
    CHECK(tessera_operation_find(info.name) == operation);
    CHECK(strlen(info.family) > 0 && strlen(info.summary) > 0 && strlen(info.help) > 0 &&
          strlen(info.bound) > 0);
    CHECK(tessera_operation_example(operation, info.examples) == NULL);
    CHECK(info.examples == 0 || tessera_operation_example(operation, 0) != NULL);
    for (size_t k = 0; k < info.parameters; ++k) {
      tessera_parameter_info p = TESSERA_INIT(tessera_parameter_info);
      SUCCEEDS(tessera_parameter_get_info(operation, k, &p, &error));
      CHECK(strlen(p.name) > 0 && strlen(p.help) > 0 && p.use != NULL && p.default_value != NULL);
      CHECK(p.minimum <= p.maximum && p.count_minimum <= p.count_maximum);
      /* What is said of it holds. */
      tessera_parameters* values = NULL;
      SUCCEEDS(tessera_parameters_new(info.name, &values, &error));
      switch (p.kind) {
        case TESSERA_NUMBER:
          SUCCEEDS(tessera_set_number(values, p.name, p.minimum, &error));
          SUCCEEDS(tessera_set_number(values, p.name, p.maximum, &error));
          CHECK(tessera_set_number(values, p.name, NAN, NULL) == TESSERA_USAGE);
          if (p.maximum < 1e38)
            CHECK(tessera_set_number(values, p.name, nextafter(p.maximum, HUGE_VAL), NULL) == TESSERA_USAGE);
          CHECK(tessera_set_flag(values, p.name, 1, NULL) == TESSERA_USAGE);
          break;
        case TESSERA_INTEGER:
          SUCCEEDS(tessera_set_integer(values, p.name, (int64_t)p.minimum, &error));
          if (p.maximum < 1e18)
            CHECK(tessera_set_integer(values, p.name, (int64_t)p.maximum + 1, NULL) == TESSERA_USAGE);
          break;
        case TESSERA_FLAG:
          SUCCEEDS(tessera_set_flag(values, p.name, 1, &error));
          CHECK(tessera_set_flag(values, p.name, 2, NULL) == TESSERA_USAGE);
          CHECK(tessera_set_number(values, p.name, 1, NULL) == TESSERA_USAGE);
          break;
        case TESSERA_NUMBERS: {
          const double none[1] = {0};
          CHECK(tessera_set_numbers(values, p.name, none, 0, NULL) == TESSERA_USAGE);
          CHECK(p.counts == 0 || tessera_parameter_count(operation, k, 0) > 0);
          CHECK(tessera_parameter_count(operation, k, p.counts) == 0);
          break;
        }
        case TESSERA_CHOICE:
          CHECK(p.choices > 0 && tessera_parameter_choice(operation, k, p.choices) == NULL);
          for (size_t word = 0; word < p.choices; ++word)
            SUCCEEDS(tessera_set_text(values, p.name, tessera_parameter_choice(operation, k, word), &error));
          CHECK(tessera_set_text(values, p.name, "no such word", NULL) == TESSERA_USAGE);
          break;
        default:
          CHECK(p.kind == TESSERA_TEXT);
          SUCCEEDS(tessera_set_text(values, p.name, "some text", &error));
      }
      tessera_parameters_free(values);
    }
    FAILS(TESSERA_USAGE, "parameter",
          tessera_parameter_get_info(operation, info.parameters,
                                     &(tessera_parameter_info)TESSERA_INIT(tessera_parameter_info), &error));
  }
}

/* Layouts of the caller: what goes in by one comes out by another. */
static void test_layouts(void) {
  picture data;
  fill(data, 1);
  const tessera_pixels in = pixels_of(data, kWidth, kHeight, kChannels);
  tessera_image* image = NULL;
  SUCCEEDS(tessera_image_borrow(&in, NULL, NULL, NULL, &image, &error));

  /* Planes, upside down. */
  static float planes[kChannels][kHeight][kWidth];
  tessera_pixels out = pixels_of(&planes[0][kHeight - 1][0], kWidth, kHeight, kChannels);
  out.channel_stride = (int64_t)sizeof planes[0];
  out.pixel_stride = (int64_t)sizeof(float);
  out.row_stride = -(int64_t)sizeof planes[0][0];
  SUCCEEDS(tessera_render(image, &out, NULL, &error));
  int wrong = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < kChannels; ++c) wrong += planes[c][kHeight - 1 - y][x] != data[y][x][c];
    }
  }
  CHECK(wrong == 0);

  /* A region, in bytes, and from the planes again. */
  tessera_image* planar = NULL;
  SUCCEEDS(tessera_image_copy(&out, NULL, &planar, &error));
  uint8_t bytes[3][5][kChannels];
  tessera_pixels part = pixels_of(bytes, 0, 0, kChannels);
  part.window.x0 = 7, part.window.y0 = 2, part.window.x1 = 12, part.window.y1 = 5;
  part.type = TESSERA_UINT8;
  SUCCEEDS(tessera_render(planar, &part, NULL, &error));
  wrong = 0;
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      for (int c = 0; c < kChannels; ++c)
        wrong += bytes[y][x][c] != (uint8_t)lrintf(data[y + 2][x + 7][c] * 255);
    }
  }
  CHECK(wrong == 0);
  tessera_image_free(planar);

  /* What an image is. */
  tessera_image_info info = TESSERA_INIT(tessera_image_info);
  SUCCEEDS(tessera_image_get_info(image, &info, &error));
  CHECK(info.data_window.x1 == kWidth && info.display_window.y1 == kHeight && info.channels == kChannels);
  CHECK(info.alpha == 3 && info.type == TESSERA_FLOAT);
  CHECK(strcmp(tessera_image_channel(image, 3), "A") == 0);
  CHECK(tessera_image_channel(image, 4) == NULL && tessera_image_channel(image, -1) == NULL);
  tessera_image_free(image);

  tessera_image_options options = TESSERA_INIT(tessera_image_options);
  options.channels = "N.x,N.y,N.z,Z";
  options.alpha = "";
  options.display_window.x0 = -2, options.display_window.x1 = 9, options.display_window.y1 = 9;
  SUCCEEDS(tessera_image_copy(&in, &options, &image, &error));
  SUCCEEDS(tessera_image_get_info(image, &info, &error));
  CHECK(info.display_window.x0 == -2 && info.display_window.x1 == 9 && info.alpha == -1);
  CHECK(strcmp(tessera_image_channel(image, 1), "N.y") == 0);
  tessera_image_free(image);
  options.alpha = "B";
  FAILS(TESSERA_USAGE, "alpha", tessera_image_copy(&in, &options, &image, &error));
  options.channels = "R,G,B";
  FAILS(TESSERA_USAGE, "channels", tessera_image_copy(&in, &options, &image, &error));
  options.channels = "R,G,R,A";
  FAILS(TESSERA_USAGE, "channels", tessera_image_copy(&in, &options, &image, &error));
}

/* Typed parameters are the numbers that were given, to the last bit. */
static void test_typed_parameters(void) {
  tessera_image* const image = image_of(0);
  tessera_parameters* gain = NULL;
  SUCCEEDS(tessera_parameters_new("mulc", &gain, &error));
  FAILS(TESSERA_USAGE, "mulc",
        tessera_apply(gain, (const tessera_image* const*)&image, 1, &(tessera_image*){NULL}, &error));
  const double third[1] = {1.0 / 3};
  tessera_operation_info info = TESSERA_INIT(tessera_operation_info);
  SUCCEEDS(tessera_operation_get_info(tessera_operation_find("mulc"), &info, &error));
  tessera_parameter_info value = TESSERA_INIT(tessera_parameter_info);
  SUCCEEDS(tessera_parameter_get_info(tessera_operation_find("mulc"), 0, &value, &error));
  CHECK(value.positional == 1 && value.required == 1 && value.kind == TESSERA_NUMBERS);
  SUCCEEDS(tessera_set_numbers(gain, value.name, third, 1, &error));
  tessera_image* result = NULL;
  SUCCEEDS(tessera_apply(gain, (const tessera_image* const*)&image, 1, &result, &error));
  picture data, out;
  fill(data, 0);
  const tessera_pixels pixels = pixels_of(out, kWidth, kHeight, kChannels);
  SUCCEEDS(tessera_render(result, &pixels, NULL, &error));
  int wrong = 0;
  for (int i = 0; i < kWidth * kHeight * kChannels; ++i) {
    const float want = (float)third[0] * ((float*)data)[i];
    wrong += ((float*)out)[i] != want;
  }
  CHECK(wrong == 0);
  tessera_image_free(result);
  tessera_image_free(image);

  FAILS(TESSERA_USAGE, "mulc", tessera_set_number(gain, "nothing", 1, &error));
  FAILS(TESSERA_USAGE, "mulc", tessera_parameters_parse(gain, "1 nothing=2", &error));
  FAILS(TESSERA_USAGE, "saturat", tessera_parameters_new("saturat", &(tessera_parameters*){NULL}, &error));
  tessera_parameters_free(gain);

  tessera_parameters* blur = NULL;
  SUCCEEDS(tessera_parameters_new("blur", &blur, &error));
  FAILS(TESSERA_USAGE, "blur:sigma", tessera_set_number(blur, "sigma", -1, &error));
  FAILS(TESSERA_USAGE, "blur:sigma", tessera_set_text(blur, "sigma", "3", &error));
  FAILS(TESSERA_USAGE, "blur:sigma", tessera_set_number(blur, "sigma", INFINITY, &error));
  SUCCEEDS(tessera_set_number(blur, "sigma", 1.5, &error));
  FAILS(TESSERA_USAGE, "blur:sigma", tessera_set_integer(blur, "sigma", 2, &error));
  size_t count = 7;
  SUCCEEDS(tessera_parameters_images(blur, &count, &error));
  CHECK(count == 1);
  tessera_parameters_free(blur);
}

/* NULL, wrong handles and nonsense are answered, never followed. */
static void test_misuse(void) {
  tessera_image* image = image_of(0);
  tessera_image* result = (tessera_image*)&failures;
  tessera_parameters* parameters = (tessera_parameters*)&failures;
  picture data;
  const tessera_pixels good = pixels_of(data, kWidth, kHeight, kChannels);
  const tessera_image* const images[1] = {image};

  CHECK(tessera_error_status(NULL) == TESSERA_OK && strcmp(tessera_error_reason(NULL), "") == 0);
  tessera_error_free(NULL), tessera_image_free(NULL), tessera_parameters_free(NULL);
  FAILS(TESSERA_USAGE, "image", tessera_image_copy(&good, NULL, NULL, &error));
  FAILS(TESSERA_USAGE, "pixels", tessera_image_copy(NULL, NULL, &result, &error));
  CHECK(result == NULL);
  CHECK(tessera_image_copy(NULL, NULL, &result, NULL) == TESSERA_USAGE);
  FAILS(TESSERA_USAGE, "operation", tessera_parameters_new(NULL, &parameters, &error));
  CHECK(parameters == NULL);
  parameters = parameters_of("saturate", "1.5");
  FAILS(TESSERA_USAGE, "result", tessera_apply(parameters, images, 1, NULL, &error));
  FAILS(TESSERA_USAGE, "parameters", tessera_apply(NULL, images, 1, &result, &error));
  FAILS(TESSERA_USAGE, "saturate", tessera_apply(parameters, images, 0, &result, &error));
  FAILS(TESSERA_USAGE, "images", tessera_apply(parameters, NULL, 1, &result, &error));
  const tessera_image* const nothing[1] = {NULL};
  FAILS(TESSERA_USAGE, "images", tessera_apply(parameters, nothing, 1, &result, &error));
  const tessera_image* const other[1] = {(const tessera_image*)(const void*)parameters};
  FAILS(TESSERA_USAGE, "images", tessera_apply(parameters, other, 1, &result, &error));
  FAILS(TESSERA_USAGE, "parameters", tessera_set_number((tessera_parameters*)(void*)image, "x", 1, &error));
  FAILS(TESSERA_USAGE, "name", tessera_set_number(parameters, NULL, 1, &error));
  FAILS(TESSERA_USAGE, "line", tessera_parameters_parse(parameters, NULL, &error));
  FAILS(TESSERA_USAGE, "values", tessera_set_numbers(parameters, "weights", NULL, 3, &error));
  FAILS(TESSERA_USAGE, "operation",
        tessera_operation_get_info((const tessera_operation*)(const void*)image,
                                   &(tessera_operation_info)TESSERA_INIT(tessera_operation_info), &error));
  FAILS(TESSERA_USAGE, "info", tessera_image_get_info(image, NULL, &error));
  FAILS(TESSERA_USAGE, "image",
        tessera_image_get_info(NULL, &(tessera_image_info)TESSERA_INIT(tessera_image_info), &error));
  FAILS(TESSERA_USAGE, "saturate",
        tessera_generate(parameters, &good.window, 3, &result, &error)); /* takes images */
  tessera_parameters* const ramp = parameters_of("ramp", "");
  FAILS(TESSERA_USAGE, "window", tessera_generate(ramp, NULL, 3, &result, &error));
  FAILS(TESSERA_USAGE, "channels", tessera_generate(ramp, &good.window, 0, &result, &error));
  FAILS(TESSERA_USAGE, "ramp", tessera_apply(ramp, NULL, 0, &result, &error));
  tessera_parameters_free(ramp);

  tessera_pixels bad = good;
  bad.struct_size = 0;
  FAILS(TESSERA_USAGE, "out", tessera_render(image, &bad, NULL, &error));
  bad.struct_size = (size_t)-1;
  FAILS(TESSERA_USAGE, "out", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.data = NULL;
  FAILS(TESSERA_USAGE, "data", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.data = (char*)data + 1;
  FAILS(TESSERA_USAGE, "out", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.type = 9;
  FAILS(TESSERA_USAGE, "type", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.type = TESSERA_TYPE_DEFAULT;
  FAILS(TESSERA_USAGE, "type", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.channels = 3;
  FAILS(TESSERA_USAGE, "out", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.window.x1 = kWidth + 1;
  FAILS(TESSERA_USAGE, "out", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.window.x1 = -1;
  FAILS(TESSERA_USAGE, "window", tessera_render(image, &bad, NULL, &error));
  bad = good, bad.window.x0 = INT32_MIN, bad.window.x1 = INT32_MAX;
  FAILS(TESSERA_USAGE, "window", tessera_image_copy(&bad, NULL, &result, &error));
  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  options.threads = -1;
  FAILS(TESSERA_USAGE, "threads", tessera_render(image, &good, &options, &error));
  FAILS(TESSERA_USAGE, "file", tessera_read(NULL, NULL, &result, &error));
  FAILS(TESSERA_USAGE, "file", tessera_write(image, NULL, NULL, &error));
  FAILS(TESSERA_DATA, "/no/such/file.exr", tessera_read("/no/such/file.exr", NULL, &result, &error));

  /* Without pixels there is nothing to do. */
  bad = good, bad.window.x1 = 0;
  SUCCEEDS(tessera_render(image, &bad, NULL, &error));

  /* Data that do not fit: an operation on colours, of an image of two channels. */
  tessera_pixels two = pixels_of(data, kWidth, kHeight, 2);
  tessera_image* grey = NULL;
  SUCCEEDS(tessera_image_copy(&two, NULL, &grey, &error));
  tessera_parameters* const hue = parameters_of("hue", "30");
  FAILS(TESSERA_DATA, "hue", tessera_apply(hue, (const tessera_image* const*)&grey, 1, &result, &error));
  CHECK(result == NULL);
  tessera_parameters_free(hue);
  tessera_image_free(grey);
  tessera_parameters_free(parameters);
  tessera_image_free(image);
}

/* Structures of a version that knew fewer members, and of one that knows more. */
static void test_sizes(void) {
  tessera_image* const image = image_of(0);
  picture data;
  const tessera_pixels out = pixels_of(data, kWidth, kHeight, kChannels);
  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  options.struct_size = offsetof(tessera_render_options, progress);
  options.threads = 1;
  options.progress = (tessera_progress)0;
  memset(&options.user, 0x5a, sizeof options.user); /* beyond the size: never looked at */
  memset(&options.progress, 0x5a, sizeof options.progress);
  SUCCEEDS(tessera_render(image, &out, &options, &error));

  struct {
    tessera_image_info info;
    char later[64];
  } larger;
  memset(&larger, 0x77, sizeof larger);
  larger.info.struct_size = sizeof larger;
  SUCCEEDS(tessera_image_get_info(image, &larger.info, &error));
  CHECK(larger.info.channels == kChannels && larger.later[0] == 0x77 &&
        larger.info.struct_size == sizeof larger);
  tessera_image_info smaller;
  memset(&smaller, 0x77, sizeof smaller);
  smaller.struct_size = offsetof(tessera_image_info, channels);
  SUCCEEDS(tessera_image_get_info(image, &smaller, &error));
  CHECK(smaller.data_window.x1 == kWidth && smaller.channels == 0x77777777);
  tessera_image_free(image);
}

static void count_release(void* user) { ++*(int*)user; }

/* The caller gets his pixels back once, when the last image that uses them is gone. */
static void test_release(void) {
  static picture data;
  int released = 0;
  const tessera_pixels p = pixels_of(data, kWidth, kHeight, kChannels);
  tessera_image* image = NULL;
  tessera_pixels bad = p;
  bad.channels = 0;
  CHECK(tessera_image_borrow(&bad, NULL, count_release, &released, &image, NULL) == TESSERA_USAGE);
  CHECK(released == 0 && image == NULL);
  SUCCEEDS(tessera_image_borrow(&p, NULL, count_release, &released, &image, &error));
  tessera_image* const bright = applied("mulc", "2", image);
  tessera_image* const soft = applied("blur", "sigma=1", bright);
  tessera_image_free(image);
  tessera_image_free(bright);
  CHECK(released == 0);
  tessera_image_free(soft);
  CHECK(released == 1);
}

typedef struct {
  int calls, stop_at;
  double last;
  int shrank;
} watched;
static int32_t watch(double share, void* user) {
  watched* const w = user;
  w->shrank |= share < w->last;
  w->last = share;
  return ++w->calls != w->stop_at;
}

static void test_progress(void) {
  const int side = 1500;
  tessera_parameters* const noise = parameters_of("ramp", "");
  const tessera_window window = {0, 0, side, side};
  tessera_image *ramp = NULL, *soft = NULL;
  SUCCEEDS(tessera_generate(noise, &window, 3, &ramp, &error));
  soft = applied("blur", "sigma=3", ramp);
  float* const first = malloc((size_t)side * (size_t)side * 3 * sizeof(float));
  float* const second = malloc((size_t)side * (size_t)side * 3 * sizeof(float));
  if (first == NULL || second == NULL) exit(77);
  watched w = {0, 0, 0, 0};
  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  options.progress = watch, options.user = &w;
  tessera_pixels out = pixels_of(first, side, side, 3);
  SUCCEEDS(tessera_render(soft, &out, &options, &error));
  CHECK(w.calls > 1 && w.last == 1 && !w.shrank);
  const int calls = w.calls;
  w = (watched){0, 2, 0, 0};
  FAILS(TESSERA_CANCELLED, "evaluation", tessera_render(soft, &out, &options, &error));
  CHECK(w.calls < calls || calls == 2);
  /* Threads and memory change no bit; the graph can be used again after a refusal. */
  options.progress = NULL;
  options.threads = 1, options.memory = 32u << 20;
  SUCCEEDS(tessera_render(soft, &out, NULL, &error));
  out.data = second;
  SUCCEEDS(tessera_render(soft, &out, &options, &error));
  CHECK(memcmp(first, second, (size_t)side * (size_t)side * 3 * sizeof(float)) == 0);
  free(first), free(second);
  tessera_image_free(soft), tessera_image_free(ramp), tessera_parameters_free(noise);
}

static void test_files(const char* folder) {
  char file[4096], missing[4096];
  snprintf(file, sizeof file, "%s/c_test.exr", folder);
  snprintf(missing, sizeof missing, "%s/no/folder/c_test.exr", folder);
  tessera_image* const image = image_of(3);
  tessera_write_options options = TESSERA_INIT(tessera_write_options);
  options.type = TESSERA_HALF;
  SUCCEEDS(tessera_write(image, file, &options, &error));
  tessera_image* back = NULL;
  SUCCEEDS(tessera_read(file, NULL, &back, &error));
  tessera_image_info info = TESSERA_INIT(tessera_image_info);
  SUCCEEDS(tessera_image_get_info(back, &info, &error));
  CHECK(info.type == TESSERA_HALF && info.channels == kChannels && info.data_window.x1 == kWidth);
  picture data, out;
  fill(data, 3);
  const tessera_pixels pixels = pixels_of(out, kWidth, kHeight, kChannels);
  SUCCEEDS(tessera_render(back, &pixels, NULL, &error));
  CHECK(memcmp(data, out, sizeof data) == 0); /* 32nds are halves */
  tessera_read_options part = TESSERA_INIT(tessera_read_options);
  part.part = "beauty";
  tessera_image* none = NULL;
  FAILS(TESSERA_DATA, file, tessera_read(file, &part, &none, &error));
  CHECK(tessera_write(image, missing, NULL, NULL) == TESSERA_DATA);
  options.type = 17;
  FAILS(TESSERA_USAGE, "type", tessera_write(image, file, &options, &error));
  tessera_image_free(back), tessera_image_free(image);
  remove(file);
}

/* One line of what C++ computed, again. */
static int row_differs(const char* line) {
  char name[64];
  int x0, y0, x1, y1, channels;
  unsigned long long want;
  if (sscanf(line, "%63s %d %d %d %d %d %llx", name, &x0, &y0, &x1, &y1, &channels, &want) != 7) return 1;
  const tessera_operation* const operation = tessera_operation_find(name);
  if (operation == NULL) return 1;
  tessera_operation_info info = TESSERA_INIT(tessera_operation_info);
  tessera_parameters* parameters = NULL;
  tessera_image *inputs[16] = {NULL}, *result = NULL;
  size_t count = 0;
  if (tessera_operation_get_info(operation, &info, NULL) != TESSERA_OK ||
      tessera_parameters_new(name, &parameters, NULL) != TESSERA_OK ||
      tessera_parameters_parse(parameters, tessera_operation_example(operation, 0), NULL) != TESSERA_OK ||
      tessera_parameters_images(parameters, &count, NULL) != TESSERA_OK || count > 16) {
    return 1;
  }
  for (size_t k = 0; k < count; ++k) inputs[k] = image_of((int)k);
  const tessera_window window = {0, 0, kWidth, kHeight};
  tessera_error* error = NULL;
  const tessera_status status =
      info.generator ? tessera_generate(parameters, &window, kChannels, &result, &error)
                     : tessera_apply(parameters, (const tessera_image* const*)inputs, count, &result, &error);
  int differs = status != TESSERA_OK;
  if (differs) printf("%s: %s: %s\n", name, tessera_error_subject(error), tessera_error_reason(error));
  tessera_error_free(error);
  tessera_image_info is = TESSERA_INIT(tessera_image_info);
  differs = differs || tessera_image_get_info(result, &is, NULL) != TESSERA_OK || is.data_window.x0 != x0 ||
            is.data_window.y0 != y0 || is.data_window.x1 != x1 || is.data_window.y1 != y1 ||
            is.channels != channels;
  if (!differs) {
    const size_t bytes = (size_t)(x1 - x0) * (size_t)(y1 - y0) * (size_t)channels * sizeof(float);
    unsigned char* const data = malloc(bytes + 1);
    tessera_pixels out = pixels_of(data, 0, 0, channels);
    out.window = is.data_window;
    differs = data == NULL || tessera_render(result, &out, NULL, NULL) != TESSERA_OK;
    unsigned long long hash = 14695981039346656037u;
    for (size_t i = 0; !differs && i < bytes; ++i) hash = (hash ^ data[i]) * 1099511628211u;
    differs = differs || hash != want;
    free(data);
  }
  if (differs) printf("%s: not what C++ computes\n", name);
  tessera_image_free(result), tessera_parameters_free(parameters);
  for (size_t k = 0; k < count; ++k) tessera_image_free(inputs[k]);
  return differs;
}

static const char* rows_file;
/* Every row, by several threads at once; POSIX's, which ThreadSanitizer knows. */
struct run {
  int count, wrong;
};
static void* run_rows(void* of_run) {
  struct run* const run = of_run;
  FILE* const rows = fopen(rows_file, "r");
  char line[256];
  while (rows != NULL && fgets(line, sizeof line, rows) != NULL) {
    run->wrong += row_differs(line);
    ++run->count;
  }
  if (rows != NULL) fclose(rows);
  return NULL;
}
static void test_rows(void) {
  enum { kThreads = 3 };
  pthread_t threads[kThreads];
  struct run runs[kThreads] = {{0, 0}};
  for (int i = 0; i < kThreads; ++i) CHECK(pthread_create(&threads[i], NULL, run_rows, &runs[i]) == 0);
  for (int i = 0; i < kThreads; ++i) {
    CHECK(pthread_join(threads[i], NULL) == 0 && runs[i].count > 100);
    CHECK(runs[i].wrong == 0);
  }
}

int main(int argc, char** argv) {
  if (argc != 3) {
    fprintf(stderr, "usage: c_test ROWS FOLDER\n");
    return 2;
  }
  rows_file = argv[1];
  test_versions();
  test_registry();
  test_layouts();
  test_typed_parameters();
  test_misuse();
  test_sizes();
  test_release();
  test_progress();
  test_files(argv[2]);
  test_rows();
  if (failures > 0) printf("%d failures\n", failures);
  return failures > 0;
}
