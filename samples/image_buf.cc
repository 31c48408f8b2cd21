// A lazy pipeline between OpenImageIO's own calls, without a copy on either side.   image_buf IN OUT
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <cstdio>
#include <memory>

#include "tessera/oiio_adapter.h"
#include "tessera/tessera.h"

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: image_buf IN OUT\n");
    return 2;
  }
  // Pixels that OpenImageIO holds: read into memory, not into its image cache.
  OIIO::ImageBuf photo(argv[1]);
  if (!photo.read(0, 0, /*force=*/true)) {
    std::fprintf(stderr, "%s\n", photo.geterror().c_str());
    return 1;
  }
  try {
    // Borrowed as they are; nothing is computed while the graph is built.
    const tessera::Node source = tessera::FromImageBuf(photo);
    const tessera::Node grey = tessera::Saturate(source, 0.0);
    const tessera::Node selective = tessera::Interpolate(grey, source, 1.6);
    std::printf("%s", tessera::Explain(selective, tessera::PixelType::kFloat).c_str());

    // One pass over the pixels; the result goes back as an ImageBuf around the same memory.
    const tessera::Image image = tessera::Render(selective);
    const std::shared_ptr<OIIO::ImageBuf> result = tessera::ToImageBuf(image);
    if (result->localpixels() != static_cast<void*>(image.view().data)) {
      std::printf("the pixels were copied\n");
      return 1;
    }

    // Saturation keeps the luminance, so OpenImageIO must find the same mean before and after.
    const float weights[] = {0.2126f, 0.7152f, 0.0722f};
    double mean[2];
    const OIIO::ImageBuf* const both[] = {&photo, result.get()};
    for (int i = 0; i < 2; ++i) {
      const auto stats = OIIO::ImageBufAlgo::computePixelStats(*both[i]);
      mean[i] = weights[0] * stats.avg[0] + weights[1] * stats.avg[1] + weights[2] * stats.avg[2];
    }
    std::printf("mean luminance: %.7f before, %.7f after\n", mean[0], mean[1]);
    if (!(mean[0] - mean[1] < 1e-5 && mean[1] - mean[0] < 1e-5)) return 1;
    if (!result->write(argv[2], OIIO::TypeDesc::UINT8)) {
      std::fprintf(stderr, "%s\n", result->geterror().c_str());
      return 1;
    }
  } catch (const tessera::Error& error) {
    std::fprintf(stderr, "image_buf: %s\n", error.what());
    return 1;
  }
  return 0;
}
