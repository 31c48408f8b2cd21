/* A program that loads a plug-in, uses it, and sees that nothing else of it shows.   plugin_host PLUGIN */
#include <dlfcn.h>
#include <math.h>
#include <stdio.h>

enum { kWidth = 301, kHeight = 200 };
static float pixels[kHeight][kWidth][4];

int main(int argc, char** argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: plugin_host PLUGIN\n");
    return 2;
  }
  void* const plugin = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
  if (plugin == NULL) {
    fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  int (*saturate)(float*, int, int, double);
  *(void**)&saturate = dlsym(plugin, "saturate_pixels");
  if (saturate == NULL) {
    fprintf(stderr, "%s\n", dlerror());
    return 1;
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int c = 0; c < 4; ++c) pixels[y][x][c] = c == 3 ? 1 : (float)((x * (c + 1) + 3 * y) % 64) / 64;
    }
  }
  if (saturate(&pixels[0][0][0], kWidth, kHeight, 0) != 0) {
    fprintf(stderr, "the plug-in failed\n");
    return 1;
  }
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double rgb[3];
      for (int c = 0; c < 3; ++c) rgb[c] = (double)((x * (c + 1) + 3 * y) % 64) / 64;
      const double luminance = 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
      for (int c = 0; c < 3; ++c) {
        if (!(fabs(pixels[y][x][c] - luminance) < 1e-5)) {
          fprintf(stderr, "pixel %d,%d: found %g, expected %g\n", x, y, pixels[y][x][c], luminance);
          return 1;
        }
      }
    }
  }
  /* The plug-in says what it exports; the library that it carries is its own business. */
  if (dlsym(plugin, "tessera_version") != NULL) {
    fprintf(stderr, "the plug-in shows tessera_version\n");
    return 1;
  }
  return 0;
}
