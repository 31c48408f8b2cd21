/* Contexts and prepared graphs of the C interface.   prepared_test */
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "c/check.h"

enum { kWidth = 300, kHeight = 200, kChannels = 4, kTile = 64, kThreads = 3 };
typedef float picture[kHeight][kWidth][kChannels];
static picture data, want;

static tessera_pixels pixels_of(void* to, int x0, int y0, int x1, int y1) {
  tessera_pixels p = TESSERA_INIT(tessera_pixels);
  p.data = to;
  p.window.x0 = x0, p.window.y0 = y0, p.window.x1 = x1, p.window.y1 = y1;
  p.channels = kChannels;
  p.type = TESSERA_FLOAT;
  return p;
}

static tessera_image* applied(const char* operation, const char* line, tessera_image* to) {
  tessera_parameters* parameters = NULL;
  tessera_image* result = NULL;
  const tessera_image* const images[1] = {to};
  SUCCEEDS(tessera_parameters_new(operation, &parameters, &error));
  SUCCEEDS(tessera_parameters_parse(parameters, line, &error));
  SUCCEEDS(tessera_apply(parameters, images, 1, &result, &error));
  tessera_parameters_free(parameters);
  tessera_image_free(to);
  return result;
}

static void count_release(void* user) { ++*(int*)user; }

/* A fitted curve, a blur, and an operation that needs the whole of what is before it. */
static tessera_image* graph(int* released) {
  const tessera_pixels p = pixels_of(data, 0, 0, kWidth, kHeight);
  tessera_image* image = NULL;
  SUCCEEDS(tessera_image_borrow(&p, NULL, count_release, released, &image, &error));
  return applied("blur", "sigma=3", applied("fillholes", "", applied("curve", "srgb", image)));
}

static tessera_context_use use_of(const tessera_context* context) {
  tessera_context_use use = TESSERA_INIT(tessera_context_use);
  SUCCEEDS(tessera_context_get_use(context, &use, &error));
  return use;
}

/* Tile by tile, each thread in another order. */
struct viewer {
  const tessera_prepared* prepared;
  int first, wrong;
};
static void* view(void* of_viewer) {
  struct viewer* const v = of_viewer;
  enum { kColumns = (kWidth + kTile - 1) / kTile, kTiles = kColumns * ((kHeight + kTile - 1) / kTile) };
  static const float none = -1;
  for (int i = 0; i < kTiles; ++i) {
    const int t = (i + v->first) % kTiles, x0 = t % kColumns * kTile, y0 = t / kColumns * kTile;
    const int x1 = x0 + kTile < kWidth ? x0 + kTile : kWidth,
              y1 = y0 + kTile < kHeight ? y0 + kTile : kHeight;
    float tile[kTile][kTile][kChannels];
    for (int k = 0; k < kTile * kTile * kChannels; ++k) ((float*)tile)[k] = none;
    tessera_pixels out = pixels_of(tile, x0, y0, x1, y1);
    out.channel_stride = sizeof(float), out.pixel_stride = sizeof tile[0][0], out.row_stride = sizeof tile[0];
    if (tessera_prepared_render(v->prepared, &out, NULL, NULL, NULL) != TESSERA_OK) ++v->wrong;
    for (int y = y0; y < y1; ++y) {
      const size_t row = (size_t)(x1 - x0) * sizeof tile[0][0];
      v->wrong += memcmp(tile[y - y0], want[y][x0], row) != 0;
      if (x1 - x0 < kTile) v->wrong += tile[y - y0][x1 - x0][0] != none;
    }
  }
  return NULL;
}

/* Regions have the bits of the whole, by several threads at once, after image and context are gone. */
static void test_prepared(void) {
  int released = 0;
  tessera_image* const image = graph(&released);
  tessera_context* context = NULL;
  SUCCEEDS(tessera_context_new(NULL, &context, &error));
  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  options.context = context;
  tessera_prepared* prepared = NULL;
  SUCCEEDS(tessera_prepare(image, &options, &prepared, &error));
  tessera_image_free(image);
  tessera_context_free(context);
  CHECK(released == 0);
  pthread_t threads[kThreads];
  struct viewer viewers[kThreads];
  for (int i = 0; i < kThreads; ++i) {
    viewers[i] = (struct viewer){prepared, 7 * i, 0};
    CHECK(pthread_create(&threads[i], NULL, view, &viewers[i]) == 0);
  }
  for (int i = 0; i < kThreads; ++i) CHECK(pthread_join(threads[i], NULL) == 0 && viewers[i].wrong == 0);
  tessera_prepared_free(prepared);
  CHECK(released == 1);
}

/* What one keeps, the others have not; what is given back is gone; results are the same bits. */
static void test_contexts(void) {
  int released = 0;
  tessera_image* const image = graph(&released);
  static picture got;
  const tessera_pixels out = pixels_of(got, 0, 0, kWidth, kHeight);
  tessera_context *first = NULL, *second = NULL;
  tessera_context_limits limits = TESSERA_INIT(tessera_context_limits);
  SUCCEEDS(tessera_context_new(&limits, &first, &error));
  limits.memory = limits.cache = 1; /* nothing */
  SUCCEEDS(tessera_context_new(&limits, &second, &error));
  SUCCEEDS(tessera_context_release(NULL, &error));
  const tessera_context_use before = use_of(NULL);

  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  tessera_context* const contexts[2] = {first, second};
  for (int i = 0; i < 2; ++i) {
    memset(got, 0, sizeof got);
    options.context = contexts[i];
    SUCCEEDS(tessera_render(image, &out, &options, &error));
    CHECK(memcmp(got, want, sizeof got) == 0);
  }
  const tessera_context_use kept = use_of(first), none = use_of(second), after = use_of(NULL);
  CHECK(kept.memory > 0 && kept.cache > 0 && kept.entries > 0);
  CHECK(none.memory == 0 && none.cache == 0 && none.entries == 0);
  CHECK(after.memory == before.memory && after.cache == before.cache && after.entries == before.entries);

  limits.memory = 0; /* as at first; prepared things go */
  SUCCEEDS(tessera_context_limit(first, &limits, &error));
  const tessera_context_use less = use_of(first);
  CHECK(less.memory == kept.memory && less.cache == 0 && less.entries == 0);
  SUCCEEDS(tessera_context_release(first, &error));
  CHECK(use_of(first).memory == 0);

  SUCCEEDS(tessera_render(image, &out, NULL, &error));
  CHECK(use_of(NULL).entries > before.entries && use_of(first).entries == 0);
  SUCCEEDS(tessera_context_release(NULL, &error));
  CHECK(use_of(NULL).memory == 0);
  tessera_context_free(first), tessera_context_free(second), tessera_context_free(NULL);
  tessera_image_free(image);
}

static int32_t stop(double share, void* user) {
  ++*(int*)user;
  return share < 0;
}

static void test_failures(void) {
  int released = 0, asked = 0;
  tessera_image* const image = graph(&released);
  static picture got;
  tessera_pixels out = pixels_of(got, 0, 0, kWidth, kHeight);
  tessera_prepared* prepared = (tessera_prepared*)(void*)&failures;
  FAILS(TESSERA_USAGE, "prepared", tessera_prepare(image, NULL, NULL, &error));
  FAILS(TESSERA_USAGE, "image", tessera_prepare(NULL, NULL, &prepared, &error));
  CHECK(prepared == NULL);
  tessera_render_options options = TESSERA_INIT(tessera_render_options);
  options.context = (tessera_context*)(void*)image;
  FAILS(TESSERA_USAGE, "context", tessera_prepare(image, &options, &prepared, &error));
  FAILS(TESSERA_USAGE, "context", tessera_render(image, &out, &options, &error));
  FAILS(TESSERA_USAGE, "context", tessera_context_release(options.context, &error));
  FAILS(TESSERA_USAGE, "context", tessera_context_new(NULL, NULL, &error));
  FAILS(TESSERA_USAGE, "use", tessera_context_get_use(NULL, NULL, &error));
  tessera_context_limits limits = TESSERA_INIT(tessera_context_limits);
  limits.struct_size = 3;
  FAILS(TESSERA_USAGE, "limits", tessera_context_limit(NULL, &limits, &error));
  tessera_write_options writing = TESSERA_INIT(tessera_write_options);
  writing.context = (tessera_context*)(void*)image;
  FAILS(TESSERA_USAGE, "context", tessera_write(image, "never.exr", &writing, &error));

  /* Progress of the preparation cancels it; that of a region the region alone. */
  options.context = NULL, options.progress = stop, options.user = &asked;
  FAILS(TESSERA_CANCELLED, "evaluation", tessera_prepare(image, &options, &prepared, &error));
  CHECK(asked == 1 && prepared == NULL);
  SUCCEEDS(tessera_prepare(image, NULL, &prepared, &error));
  FAILS(TESSERA_CANCELLED, "evaluation", tessera_prepared_render(prepared, &out, stop, &asked, &error));
  CHECK(asked == 2);
  SUCCEEDS(tessera_prepared_render(prepared, &out, NULL, NULL, &error));
  CHECK(memcmp(got, want, sizeof got) == 0);
  out.window.x1 += 1;
  FAILS(TESSERA_USAGE, "out", tessera_prepared_render(prepared, &out, NULL, NULL, &error));
  out.window.x1 = 0; /* without pixels there is nothing to do */
  SUCCEEDS(tessera_prepared_render(prepared, &out, NULL, NULL, &error));
  out.channels = 3;
  FAILS(TESSERA_USAGE, "out", tessera_prepared_render(prepared, &out, NULL, NULL, &error));
  FAILS(TESSERA_USAGE, "prepared", tessera_prepared_render(NULL, &out, NULL, NULL, &error));
  FAILS(TESSERA_USAGE, "prepared",
        tessera_prepared_render((const tessera_prepared*)(const void*)image, &out, NULL, NULL, &error));
  tessera_prepared_free(NULL), tessera_prepared_free(prepared);
  tessera_image_free(image);
  CHECK(released == 1);
}

int main(void) {
  for (int i = 0; i < kWidth * kHeight * kChannels; ++i) {
    const int x = i / kChannels % kWidth, y = i / kChannels / kWidth, c = i % kChannels;
    (&data[0][0][0])[i] =
        c == 3 ? (x / 8 + y / 8) % 2 != 0 : (float)((7 * x + 13 * y + x * y + 5 * c) % 64) / 64;
  }
  int released = 0;
  tessera_image* const image = graph(&released);
  const tessera_pixels out = pixels_of(want, 0, 0, kWidth, kHeight);
  SUCCEEDS(tessera_render(image, &out, NULL, &error));
  tessera_image_free(image);
  test_prepared();
  test_contexts();
  test_failures();
  if (failures > 0) printf("%d failures\n", failures);
  return failures > 0;
}
