// The table of codecs.
#include "io/codec/codec.h"

#include <iterator>
#include <string_view>

namespace tessera::io {
namespace {

constexpr struct {
  std::string_view format;
  Choice<Decoder> (*decoder)(const std::string& file, int part, const OIIO::ImageSpec& spec, int first,
                             int last);
  Choice<Encoder> (*encoder)(const OIIO::ImageSpec& spec, OIIO::Filesystem::IOProxy& stream, int threads);
} kCodecs[] = {{"openexr", MakeExrDecoder, MakeExrEncoder},
               {"jpeg", MakeJpegDecoder, nullptr},
               {"png", MakePngDecoder, MakePngEncoder},
               {"tiff", MakeTiffDecoder, MakeTiffEncoder}};

}  // namespace

Choice<Decoder> MakeDecoder(const std::string& format, const std::string& file, int part,
                            const OIIO::ImageSpec& spec, int first, int last) {
  for (const auto& row : kCodecs) {
    if (row.format == format) return row.decoder(file, part, spec, first, last);
  }
  return {nullptr, "no codec for " + format};
}

Choice<Encoder> MakeEncoder(const std::string& format, const OIIO::ImageSpec& spec,
                            OIIO::Filesystem::IOProxy& stream, int threads) {
  for (const auto& row : kCodecs) {
    if (row.format == format && row.encoder != nullptr) return row.encoder(spec, stream, threads);
  }
  return {nullptr, "no codec for " + format};
}

}  // namespace tessera::io
