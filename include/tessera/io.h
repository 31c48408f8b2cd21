/// Images in files. Formats and metadata are OpenImageIO's work; its own images: oiio_adapter.h. @file
#ifndef TESSERA_IO_H_
#define TESSERA_IO_H_

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/image.h"
#include "tessera/node.h"
#include "tessera/render.h"
#include "tessera/stored.h"

TESSERA_API_BEGIN
namespace tessera {

/// Who decodes and encodes pixels.
enum class Codec : uint8_t {
  kAuto,  ///< the fastest that gives the same pixels and metadata: ours where it can, else OpenImageIO's
  kOpenImageIO,  ///< OpenImageIO's own, always
};

/// Which formats are read.
enum class Formats : uint8_t {
  kTrusted,  ///< those that are stood behind: OpenEXR, PNG, JPEG, TIFF, DPX, Cineon, Radiance, GIF, BMP,
             ///< WebP, JPEG2000, HEIF, SGI, PNM, Targa, RLA, NumPy, OpenVDB; told by what a file begins with
  kAll,      ///< all of OpenImageIO's, for files that come from no stranger
};

/// Which of a file's images is read.
struct ReadOptions {
  int subimage = 0;            ///< index of the part
  std::string part{};          ///< or its name (EXR part, TIFF page name); wins over the index when not empty
  Codec codec = Codec::kAuto;  ///< of the pixels; OpenImageIO reads the header
  Formats formats = Formats::kTrusted;  ///< that the file may be of

  /// Not 0: an image of these sides has detail enough, for a thumbnail say. A JPEG is then decoded at 1/2,
  /// 1/4 or 1/8 of its sides, rounded up, as long as they are at least these: other pixels than a full image
  /// filtered down has, in a fraction of the time. Other files, and all by Codec::kOpenImageIO, are read as
  /// they are.
  int enough_width = 0;
  int enough_height = 0;  ///< the same
};

/// A lazy image of a file: the header is read now, pixels when evaluated, only the channels and rows that the
/// pipeline uses. Types other than uint8, uint16, half and float, and channels of different types unless all
/// are of the first's, are converted to float by OpenImageIO. The colour state is what the file says, the
/// surest first: colorInteropID, an ICC profile that describes a known space, CICP, chromaticities, and what
/// OpenImageIO takes it for; an EXR without any of them is scene_linear. Unassociated alpha is multiplied in,
/// as by oiiotool. A tiled file says so with the attributes tile_width and tile_height, and Write then writes
/// tiles where the format has them. The slices of a volume file lie one above the other and are read at once.
/// Throws Error naming the file: missing, a directory, not an image, truncated header, absurd dimensions,
/// deep data, an unknown part (those present are listed).
Node Read(const std::string& file, const ReadOptions& options = {});

/// The image with an ICC profile, which writers embed where the format can. Its colour space is the one that
/// the profile describes where that is known, else unknown. Throws Error for bytes that are no profile.
Node WithIccProfile(const Node& image, const std::vector<std::byte>& profile);
/// The profile that an image carries, empty for none.
std::vector<std::byte> IccProfileOf(const ImageSpec& spec);

/// How a file is written.
struct WriteOptions {
  std::optional<PixelType> type{};  ///< empty: the node's spec().type
  RenderOptions render{};           ///< of the evaluation

  /// Added to, or replacing, the node's metadata; one without any value removes it. OpenImageIO's output
  /// hints ("compression", "oiio:BitsPerSample") work too; tile_width and tile_height of 0 ask for scanlines.
  std::vector<Attribute> attributes{};
  RunStats* stats = nullptr;   ///< filled in when not null
  Codec codec = Codec::kAuto;  ///< of the pixels; metadata are written by OpenImageIO
  bool sync = true;            ///< the file is on the disk, not in its cache, before it gets its name
};

/// Evaluates and writes, streaming bands of rows. The file is tagged with the colour state: oiio:ColorSpace
/// (PNG's sRGB and gAMA chunks, Exif), in EXR chromaticities and colorInteropID. The file appears whole or
/// not at all: it is written beside its name and renamed; an existing file stays as it is until then, and
/// keeps its permissions. The output may be one of the graph's own inputs. What the format cannot hold:
///   type     the format's own nearest type is written (a float image becomes uint8 in JPEG and PNG), with
///            the one rounding of the engine;
///   windows  a format without display windows gets the pixels of the display window, zero where there are
///   none; alpha    is left out by formats without it (JPEG, HDR); channels beyond that: Error naming those
///   found and those allowed.
/// Throws Error naming the file, also for an unknown extension, a missing directory, a full disk.
void Write(const Node& node, const std::string& file, const WriteOptions& options = {});

/// The same in two steps, so that several outputs appear together: Write writes the temporary file, Commit
/// renames. Destroying an uncommitted output removes it.
class PendingOutput {
 public:
  /// Evaluates and writes the temporary file; Error as Write.
  PendingOutput(const Node& node, const std::string& file, const WriteOptions& options);
  /// One of several images of a file, and what is its own.
  struct Part {
    Node node;                            ///< the pixels
    std::optional<PixelType> type{};      ///< empty: the node's spec().type
    std::vector<Attribute> attributes{};  ///< as WriteOptions::attributes
  };
  /// A file of several images, in order: parts of an EXR, pages of a TIFF, frames of a GIF. Throws Error for
  /// a format that holds one alone.
  PendingOutput(const std::vector<Part>& parts, const std::string& file, const WriteOptions& options);
  /// A file of these bytes.
  PendingOutput(const std::string& file, const std::vector<std::byte>& bytes, bool sync = true);
  /// Takes over the output that is moved from.
  PendingOutput(PendingOutput&&) noexcept;
  PendingOutput& operator=(PendingOutput&&) = delete;
  ~PendingOutput();
  /// Throws Error naming the file when it cannot be renamed.
  void Commit();
  /// Called for each finished file while no other process can have replaced it, with the name that it has for
  /// now and the one that it gets; what it throws ends the commit before any name is given.
  using Look = std::function<void(const std::string& temporary, const std::string& file)>;
  /// Commits all of them, or, where one of them cannot be, none: what was there stays. Those that are
  /// committed already are left out. Throws Error naming the file that cannot be renamed.
  static void CommitTogether(const std::vector<PendingOutput*>& outputs, const Look& look = {});
  /// The type that was written: the one asked for, or the nearest that the format has.
  PixelType type() const { return type_; }
  /// The uncommitted file decoded again: native codes of all channels, for VerifyStored. Where the format
  /// does not keep what it is given (JPEG, lossy EXR compressions), the pixels that it was given, evaluated
  /// once more; a remark says so. Of a file of several images, that one. To be used before Commit.
  StoredPixels ReadBack(int part = 0) const;

 private:
  /// Of no file yet. The others begin with it, so that the temporary file goes, whatever they throw.
  PendingOutput(const std::string& file, bool sync);

  std::function<StoredPixels(int)> read_back_;
  std::string temporary_, file_;  ///< temporary_ is empty when committed or moved from
  bool sync_ = true;
  PixelType type_ = PixelType::kFloat;
};

/// The type that Write would store, before a pixel is computed: what the format has for the one asked for.
/// Throws Error as Write for what shows then: an unknown extension, channels or sides that the format does
/// not hold, a missing directory or one that cannot be written. A file of that name stays as it is.
PixelType StoredType(const Node& node, const std::string& file, const WriteOptions& options = {});

/// Whether that file's format holds several images.
bool HoldsParts(const std::string& file);

/// OpenEXR, which has threads of its own beside those of evaluations, takes so many, and none for 1; 0: one
/// per core, as when the process began. Of the whole process, for files that are opened from then on.
void LimitCodecThreads(int threads);

/// Removes the temporary files of every unfinished output of this process; async-signal-safe, for SIGINT
/// handlers.
void RemoveUnfinishedOutputs();

/// The names of a file's subimages in order, empty for one that has none; throws Error.
std::vector<std::string> Subimages(const std::string& file, Formats formats = Formats::kTrusted);

/// What is told of an image, as `oiiotool --info` does.
struct InfoOptions {
  bool verbose = false;                 ///< metadata too
  bool all = false;                     ///< every image of a file
  bool xml = false;                     ///< as XML, not text
  bool hash = false;                    ///< the SHA-1 of its pixels
  std::string match{};                  ///< regular expression of the items that are told; empty: all
  std::string no_match{};               ///< of those that are not
  Formats formats = Formats::kTrusted;  ///< that a file may be of
};
/// Of a file: size, channels, type, format; every item where asked. Throws Error naming the file, and for
/// what is no regular expression.
std::string InfoText(const std::string& file, const InfoOptions& options);
/// Of an image, by what it would be written with.
std::string InfoText(const ImageSpec& spec, const std::vector<Attribute>& own, const InfoOptions& options);

/// The SHA-1 of a file's pixels in its own type, in hexadecimal digits.
std::string PixelHash(const std::string& file, int subimage = 0, Formats formats = Formats::kTrusted);

/// How pixels are printed.
struct DumpOptions {
  bool empty = true;                    ///< pixels that are 0 too
  std::string c_name{};                 ///< not empty: as an array of that name in C
  Formats formats = Formats::kTrusted;  ///< that the file may be of
};
/// Every pixel of a file, as `oiiotool --dumpdata` prints it, piece by piece.
void DumpPixels(const std::string& file, int subimage, const DumpOptions& options,
                const std::function<void(const std::string&)>& print);

/// The formats that OpenImageIO reads or writes with the extensions of their names, a line each.
std::string FormatList();

/// What `oiiotool --stats` prints about an image, line for line: minimum, maximum, mean, standard deviation,
/// counts of NaN, infinite and finite values, whether constant and monochrome. Integer types are reported in
/// codes. The Node form evaluates in float32 first, into memory.
std::string StatsText(const Image& image);
/// The same of a node that is evaluated first.
std::string StatsText(const Node& node, const RenderOptions& options = {});

/// Thresholds of a comparison, as oiiotool's --fail, --failpercent, --hardfail and the same for warnings.
struct DiffOptions {
  double fail = 1e-6;                                          ///< a pixel fails whose error is larger
  double fail_percent = 0;                                     ///< so many per cent of the pixels may fail
  double hard_fail = std::numeric_limits<double>::infinity();  ///< one error larger than this fails the image
  double warn = 1e-6;                                          ///< a pixel warns whose error is larger
  double warn_percent = 0;                                     ///< so many per cent of the pixels may warn
  double hard_warn = std::numeric_limits<double>::infinity();  ///< one error larger than this warns
};
/// What the thresholds say of a comparison.
enum class DiffVerdict : uint8_t { kPass, kWarning, kFailure };
/// What a comparison found.
struct DiffReport {
  DiffVerdict verdict = DiffVerdict::kPass;  ///< by the thresholds
  double mean_error = 0;                     ///< mean absolute difference
  double rms_error = 0;                      ///< root mean square of the differences
  double psnr = 0;                           ///< peak signal to noise ratio in dB, of a peak of 1
  double max_error = 0;                      ///< largest absolute difference
  int max_x = 0;                             ///< where the largest error is
  int max_y = 0;                             ///< where the largest error is
  int max_channel = 0;                       ///< where the largest error is
  int64_t warned = 0;                        ///< pixels over the thresholds
  int64_t failed = 0;                        ///< pixels over the thresholds
  std::string text;                          ///< what oiiotool --diff prints after its first line
};
/// Compares every channel over the union of the data windows (black where one has no pixel), integers as [0,
/// 1].
DiffReport Compare(const Image& a, const Image& b, const DiffOptions& options = {});

}  // namespace tessera
TESSERA_API_END

#endif  // TESSERA_IO_H_
