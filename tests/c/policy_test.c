/* Policies of the C interface, and its sandbox.   policy_test FOLDER */
#define _DEFAULT_SOURCE
#include <unistd.h>

#include "c/check.h"

enum { kWidth = 40, kHeight = 30, kChannels = 3 };
typedef float picture[kHeight][kWidth][kChannels];
static char file[4096], unlisted[4096], link_name[4096];

static tessera_pixels pixels_of(float* data) {
  tessera_pixels pixels = TESSERA_INIT(tessera_pixels);
  pixels.data = data;
  pixels.window.x1 = kWidth, pixels.window.y1 = kHeight;
  pixels.channels = kChannels, pixels.type = TESSERA_FLOAT;
  return pixels;
}

static void fill(picture p) {
  for (int i = 0; i < kHeight * kWidth * kChannels; ++i) ((float*)p)[i] = (float)(i % 256) / 255;
}

/* What reading comes to; `status` of the header or of the pixels. */
static void reads(const char* name, tessera_status status) {
  tessera_read_options options = TESSERA_INIT(tessera_read_options);
  options.all_formats = 1;
  tessera_image* image = NULL;
  if (status != TESSERA_OK) {
    FAILS(status, name, tessera_read(name, &options, &image, &error));
    CHECK(image == NULL);
    return;
  }
  picture want, got;
  fill(want);
  const tessera_pixels pixels = pixels_of(&got[0][0][0]);
  SUCCEEDS(tessera_read(name, &options, &image, &error));
  SUCCEEDS(tessera_render(image, &pixels, NULL, &error));
  CHECK(memcmp(want, got, sizeof want) == 0);
  tessera_image_free(image);
}

static void sets(const tessera_policy* policy) {
  SUCCEEDS(tessera_set_policy(policy, &error));
  tessera_policy now = TESSERA_INIT(tessera_policy);
  SUCCEEDS(tessera_get_policy(&now, &error));
  const tessera_policy none = TESSERA_INIT(tessera_policy);
  if (policy == NULL) policy = &none;
  CHECK(now.pixels == policy->pixels && now.channels == policy->channels);
  CHECK(now.listed_formats == policy->listed_formats && now.configs_inside == policy->configs_inside);
  CHECK(now.no_output_links == policy->no_output_links && now.sandbox == policy->sandbox);
  CHECK(now.reader_memory == policy->reader_memory && now.reader_seconds == policy->reader_seconds);
}

static void test_limits(void) {
  tessera_policy policy = TESSERA_INIT(tessera_policy);
  policy.pixels = kWidth * kHeight, policy.channels = kChannels;
  sets(&policy);
  reads(file, TESSERA_OK);
  policy.pixels -= 1;
  sets(&policy);
  reads(file, TESSERA_DATA);
  policy.pixels = 0, policy.channels = 2;
  sets(&policy);
  reads(file, TESSERA_DATA);
  sets(NULL);
  reads(file, TESSERA_OK);
  reads(unlisted, TESSERA_OK);
  policy.channels = 0, policy.listed_formats = 1;
  sets(&policy);
  reads(unlisted, TESSERA_DATA);
  sets(NULL);
}

static void test_links(const tessera_image* image) {
  remove(link_name);
  CHECK(symlink(file, link_name) == 0);
  tessera_policy policy = TESSERA_INIT(tessera_policy);
  policy.no_output_links = 1;
  sets(&policy);
  FAILS(TESSERA_DATA, link_name, tessera_write(image, link_name, NULL, &error));
  sets(NULL);
  SUCCEEDS(tessera_write(image, link_name, NULL, &error));
  remove(link_name);
}

static void test_sandbox(void) {
  tessera_policy policy = TESSERA_INIT(tessera_policy);
  for (policy.sandbox = TESSERA_SANDBOX_UNLISTED; policy.sandbox <= TESSERA_SANDBOX_ALL; ++policy.sandbox) {
    sets(&policy);
    reads(file, TESSERA_OK);
    reads(unlisted, TESSERA_OK);
  }
  policy.sandbox = TESSERA_SANDBOX_ALL, policy.reader_memory = 1 << 28, policy.reader_seconds = 60;
  sets(&policy);
  reads(file, TESSERA_OK);
  policy.pixels = 7; /* held against the file there, too */
  sets(&policy);
  reads(file, TESSERA_DATA);
  policy.pixels = 0;
  sets(&policy);
  tessera_end_sandbox();
  reads(file, TESSERA_SYSTEM);
  sets(NULL);
  reads(file, TESSERA_OK);
}

static void test_safe(void) {
  tessera_policy safe = TESSERA_INIT(tessera_policy);
  SUCCEEDS(tessera_safe_policy(&safe, &error));
  CHECK(safe.pixels == 1 << 28 && safe.channels == 64 && safe.listed_formats && safe.configs_inside);
  CHECK(safe.no_output_links && safe.sandbox == TESSERA_SANDBOX_ALL && safe.reader_seconds == 300);
  sets(&safe);
  sets(NULL);
}

static void test_misuse(void) {
  tessera_policy policy = TESSERA_INIT(tessera_policy);
  policy.pixels = -1;
  FAILS(TESSERA_USAGE, "pixels", tessera_set_policy(&policy, &error));
  policy.pixels = 5, policy.sandbox = 3;
  FAILS(TESSERA_USAGE, "sandbox", tessera_set_policy(&policy, &error));
  policy.sandbox = 0, policy.reader_seconds = -1;
  FAILS(TESSERA_USAGE, "reader_seconds", tessera_set_policy(&policy, &error));
  FAILS(TESSERA_USAGE, "policy", tessera_get_policy(NULL, &error));
  policy.struct_size = 1;
  FAILS(TESSERA_USAGE, "policy", tessera_set_policy(&policy, &error));
  tessera_policy now = TESSERA_INIT(tessera_policy);
  SUCCEEDS(tessera_get_policy(&now, &error));
  CHECK(now.pixels == 0); /* nothing was set */
  /* Of a program that knows no more than the first limit. */
  policy.struct_size = offsetof(tessera_policy, channels), policy.channels = 2;
  SUCCEEDS(tessera_set_policy(&policy, &error));
  SUCCEEDS(tessera_get_policy(&now, &error));
  CHECK(now.pixels == 5 && now.channels == 0 && now.reader_seconds == 0);
  sets(NULL);
}

int main(int argc, char** argv) {
#ifdef TESSERA_SECCOMP
  SUCCEEDS(tessera_start_sandbox(&error)); /* before anything else */
#endif
  if (argc != 2) {
    fprintf(stderr, "usage: policy_test FOLDER\n");
    return 2;
  }
  snprintf(file, sizeof file, "%s/policy_test.png", argv[1]);
  snprintf(unlisted, sizeof unlisted, "%s/policy_test.fits", argv[1]);
  snprintf(link_name, sizeof link_name, "%s/policy_link.png", argv[1]);
  picture data;
  fill(data);
  const tessera_pixels pixels = pixels_of(&data[0][0][0]);
  tessera_image* image = NULL;
  SUCCEEDS(tessera_image_copy(&pixels, NULL, &image, &error));
  tessera_write_options options = TESSERA_INIT(tessera_write_options);
  options.type = TESSERA_UINT8;
  SUCCEEDS(tessera_write(image, file, &options, &error));
  SUCCEEDS(tessera_write(image, unlisted, NULL, &error));
  test_limits();
  test_links(image);
  test_safe();
  test_misuse();
#ifdef TESSERA_SECCOMP
  test_sandbox();
#endif
  tessera_image_free(image);
  remove(file), remove(unlisted);
  if (failures > 0) printf("%d failures\n", failures);
  return failures > 0;
}
