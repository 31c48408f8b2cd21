/* The code of stb_image_resize2, in a file of its own because it is compiled for AVX2. */
#define STB_IMAGE_RESIZE_IMPLEMENTATION
#include <stb/stb_image_resize2.h>
