// What a sink does about files that OpenImageIO has opened and written by itself: mends them, compares them.
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <span>
#include <string_view>
#include <system_error>

#include "io/file_sink.h"
#include "io/ico_check.h"
#include "io/rla_repair.h"
#include "io/spec.h"
#include "tessera/error.h"
#include "tessera/error_kind.h"

namespace tessera::io {
namespace {

// OpenImageIO leaves what was on its stack, addresses say, behind the name in an SGI's header.
bool ClearBehindName(const std::string& file, size_t name) {
  constexpr std::streamoff kName = 24;
  const std::array<char, 80> zeros{};
  name = std::min(name, zeros.size() - 1);
  std::fstream stream(file, std::ios::in | std::ios::out | std::ios::binary);
  stream.seekp(kName + static_cast<std::streamoff>(name));
  stream.write(zeros.data(), static_cast<std::streamsize>(zeros.size() - name));
  stream.close();
  return stream.good();
}

// Writers that overlook a failed write and go on, and keep what they are given, so that all that was written
// is compared.
constexpr std::string_view kOverlookFailures[] = {"fits", "ico", "rla", "sgi"};

}  // namespace

// Fewer bits than the type has keep a part of it.
bool FileSink::KeepsBits() const {
  const int bits = file_spec_.get_int_attribute("oiio:BitsPerSample");
  return bits == 0 || bits == static_cast<int>(8 * PixelBytes(type_));
}

// OpenImageIO's TIFF writer overlooks what it could not write of any image but the first; it may divide
// colours by alpha.
bool FileSink::Compares() const {
  if (stream_ || !KeepsBits()) return false;
  if (several_) return file_spec_.get_int_attribute("oiio:UnassociatedAlpha") == 0;
  return std::find(std::begin(kOverlookFailures), std::end(kOverlookFailures), output_->format_name()) !=
         std::end(kOverlookFailures);
}

void FileSink::Note(int rows, const std::byte* data, ptrdiff_t row_stride) {
  if (!Compares()) return;
  const size_t pixel = kept_.size() * PixelBytes(type_), row = static_cast<size_t>(window_.width()) * pixel;
  for (int y = 0; y < rows; ++y, data += row_stride) {
    base::AddToDigest(digest_, {data, row});
    last_column_.insert(last_column_.end(), data + row - pixel, data + row);
  }
}

// What OpenImageIO's writers leave wrong.
void FileSink::Mend() {
  const std::string_view format = output_->format_name();
  if (format == "sgi" &&
      !ClearBehindName(temporary_, file_spec_.get_string_attribute("ImageDescription").size()))
    Fail("its header cannot be mended");
  if (format == "rla" && type_ != PixelType::kFloat && Compares() &&
      !RepairRla(temporary_, window_.width(), window_.height(), static_cast<int>(kept_.size()),
                 PixelBytes(type_), last_column_))
    Fail("its last column cannot be mended");
}

// Of a file of several images, which is closed.
void FileSink::CheckPart() const {
  if (const auto found = StoredDigest(Layout()); found && Compares() && *found != digest_)
    Fail("the file that was written holds other pixels when it is read back");
}

// Formats that open files themselves may lose bytes without a word.
void FileSink::CheckReadable() {
  if (const int code = GrowthFailure(temporary_); code != 0) {
    throw SystemError(shown_,
                      "cannot be written: " + std::error_code(code, std::generic_category()).message());
  }
  if (several_) {
    for (const FileSink* const part : parts_) part->CheckPart();
    return;
  }
  if (std::string_view(output_->format_name()) == "ico") {
    if (Compares() &&
        !IcoHolds(temporary_, window_.width(), window_.height(), static_cast<int>(kept_.size()), digest_))
      Fail("the file that was written holds other pixels");
    return;
  }
  // By the name of the format: by that of a file it is none where the file is damaged.
  const auto input = OIIO::ImageInput::create(output_->format_name());
  OIIO::ImageSpec found;
  if (!input) {
    OIIO::geterror();  // a format that can only be written
    return;
  }
  bool compares = Compares();
  const OIIO::TypeDesc type = compares ? TypeDescOf(type_) : OIIO::TypeFloat;
  std::vector<std::byte> row;
  base::Digest digest{};
  bool ok = input->open(temporary_, found) && found.width == file_spec_.width &&
            found.height == file_spec_.height && found.nchannels >= 1;
  if (ok) {
    const size_t kept = kept_.size() * type.size(),
                 pixel = static_cast<size_t>(found.nchannels) * type.size();
    compares &= kept == pixel || (kept < pixel && kept_.size() % 2 != 0);
    row.resize(static_cast<size_t>(found.width) * pixel);
    // libtiff says what it could not write; the others have to show all rows.
    const int last = found.y + found.height;
    const int first = std::string_view(output_->format_name()) == "tiff" ? last - 1 : found.y;
    for (int y = first; ok && y < last && found.tile_width == 0; ++y) {
      ok = input->read_scanline(y, 0, type, row.data());
      if (!compares) continue;
      // Some readers add an alpha.
      for (size_t x = 1; kept < pixel && x < static_cast<size_t>(found.width); ++x)
        std::memmove(row.data() + x * kept, row.data() + x * pixel, kept);
      base::AddToDigest(digest, std::span(row).first(static_cast<size_t>(found.width) * kept));
    }
  }
  if (ok && compares && digest != digest_)
    Fail("the file that was written holds other pixels when it is read back");
  if (!ok) Fail("the file that was written cannot be read back: " + input->geterror());
}

}  // namespace tessera::io
