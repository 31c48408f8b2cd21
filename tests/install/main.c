/* An outside program in C: finds an operation of each component, renders one, writes and reads a file.
 * outside_c FILE */
#include <stdio.h>
#include <tessera/c.h>
#include <tessera/version.h>

static int fails(tessera_status status, tessera_error* error) {
  if (status == TESSERA_OK) return 0;
  fprintf(stderr, "%s: %s\n", tessera_error_subject(error), tessera_error_reason(error));
  return 1;
}

int main(int argc, char** argv) {
  if (argc != 2 || tessera_c_version() != TESSERA_C_VERSION) return 2;
  const char* const names[] = {"saturate", "colorconvert", "volume"};
  for (int i = 0; i < 3; ++i) {
    if (tessera_operation_find(names[i]) == NULL) {
      fprintf(stderr, "no operation %s\n", names[i]);
      return 1;
    }
  }
  float pixels[2][3][3] = {{{1, 0.5f, 0}, {0, 1, 0}, {0, 0, 1}}, {{1, 0, 0}, {1, 1, 1}, {0, 0, 0}}};
  tessera_pixels p = TESSERA_INIT(tessera_pixels);
  p.data = pixels, p.window.x1 = 3, p.window.y1 = 2, p.channels = 3, p.type = TESSERA_FLOAT;
  tessera_error* error = NULL;
  tessera_image *image = NULL, *grey = NULL, *back = NULL;
  tessera_parameters* saturate = NULL;
  if (fails(tessera_image_copy(&p, NULL, &image, &error), error)) return 1;
  if (fails(tessera_parameters_new("saturate", &saturate, &error), error)) return 1;
  if (fails(tessera_parameters_parse(saturate, "0", &error), error)) return 1;
  const tessera_image* const images[] = {image};
  if (fails(tessera_apply(saturate, images, 1, &grey, &error), error)) return 1;
  if (fails(tessera_write(grey, argv[1], NULL, &error), error)) return 1;
  if (fails(tessera_read(argv[1], NULL, &back, &error), error)) return 1;
  if (fails(tessera_render(back, &p, NULL, &error), error)) return 1;
  const float found = pixels[0][0][2], expected = 0.2126f + 0.7152f / 2;
  if (!(found > expected - 1e-6f && found < expected + 1e-6f)) {
    fprintf(stderr, "found %g, expected %g\n", found, expected);
    return 1;
  }
  tessera_image_free(back), tessera_image_free(grey), tessera_image_free(image);
  tessera_parameters_free(saturate);
  return 0;
}
