// Draws graphs step by step: what a row refuses is drawn again.
#include "random/generate.h"

#include <algorithm>
#include <iterator>

#include "graph/op.h"
#include "ops/apply.h"
#include "support/pictures.h"
#include "tessera/error.h"
#include "tessera/render.h"

namespace tessera::random {
namespace {

using ops::OpInfo;

// Larger results are not worth their time.
constexpr int64_t kMostSamples = 40000;
// But results above 8 MB, which are stored around the cache: every so many-th case is one.
constexpr uint64_t kLargeEvery = 400, kFirstLarge = 200;
constexpr int64_t kMostOfLarge = 12000000;
constexpr double kLargeBytes = 8.4e6;

// Rows whose preparation takes long come less often.
double WeightOf(const OpInfo& op) {
  if (op.name == "volume") return 0.12;
  if (op.family == "ocio") return 0.3;
  if (op.name == "lic" || op.name == "envconvert" || op.name == "solid") return 0.5;
  return 1;
}

// Of a row on small pictures, or kSource where its examples cannot say.
graph::OpKind KindOf(const OpInfo& op) {
  if (op.generator || op.examples.empty() || op.family == "volume" || op.family == "ocio")
    return graph::OpKind::kSource;
  try {
    const ops::Arguments arguments = ops::ParseExample(op, op.examples[0]);
    const std::vector<Node> inputs(static_cast<size_t>(op.Operands(arguments)),
                                   FromImage(Image(ImageSpec(8, 8, 4))));
    return op.make(inputs, arguments, nullptr).data()->op->Kind();
  } catch (const Error&) {
    return graph::OpKind::kSource;
  }
}

bool OnlyPointsBelow(const Node& node) {
  const graph::OpKind kind = node.data()->op->Kind();
  if (kind == graph::OpKind::kTile || kind == graph::OpKind::kWhole || kind == graph::OpKind::kCrop)
    return false;
  for (size_t k = 0; k < node.data()->inputs.size(); ++k) {
    if (node.data()->op->NeedsWhole(static_cast<int>(k)) || !OnlyPointsBelow(node.data()->inputs[k]))
      return false;
  }
  return true;
}

}  // namespace

const char* CheckName(Check check) {
  constexpr const char* kNames[] = {"rules",     "each-rule", "types",  "tiles",    "threads", "shuffle",
                                    "pixels",    "stream",    "file",   "in-place", "eager",   "targets",
                                    "reference", "plain",     "verify", "json",     "paged"};
  static_assert(std::size(kNames) == static_cast<size_t>(Check::kCount));
  return kNames[static_cast<size_t>(check)];
}

Node MakeStep(const Step& step, const std::vector<Node>& values) {
  std::vector<Node> inputs;
  for (const int i : step.inputs) inputs.push_back(values.at(static_cast<size_t>(i)));
  ImageSpec spec;
  if (step.op->generator) {
    spec = ImageSpec(step.window.width(), step.window.height(), step.channels);
    spec.data_window = spec.display_window = step.window;
  }
  const ops::Arguments arguments = Parsed(*step.op, step.words);
  if (step.op->Operands(arguments) != static_cast<int>(inputs.size()))
    throw Error(step.op->name, "has another number of operands");
  return ops::Apply(*step.op, inputs, arguments, step.op->generator ? &spec : nullptr);
}

Built Build(const Case& c, Backing backing) {
  Built built;
  for (const Picture& picture : c.pictures) {
    if (backing == Backing::kStreamed) {
      const Image image(SpecOf(picture));
      CopySamples(Paint(picture).view(), image.view());
      built.values.push_back(Streamed(image));
    } else if (backing == Backing::kFloats &&
               (picture.type == PixelType::kUint8 || picture.type == PixelType::kUint16)) {
      const Image image(SpecOf(picture));
      CopySamples(Paint(picture).view(), image.view());
      built.values.push_back(FromImage(testing::Unpacked(image)));
    } else {
      built.pixels.push_back(Paint(picture));
      built.values.push_back(FromView(built.pixels.back().view(), SpecOf(picture)));
    }
  }
  for (const Step& step : c.steps) built.values.push_back(MakeStep(step, built.values));
  return built;
}

std::vector<const OpInfo*> RegistryRows() {
  std::vector<const OpInfo*> rows;
  for (const OpInfo& op : ops::Registry()) rows.push_back(&op);
  return rows;
}

void Prune(Case& c) {
  std::vector<bool> used(static_cast<size_t>(c.values()));
  used.back() = true;
  const int pictures = static_cast<int>(c.pictures.size());
  for (int v = c.values() - 1; v >= pictures; --v) {
    if (!used[static_cast<size_t>(v)]) continue;
    for (const int i : c.steps[static_cast<size_t>(v - pictures)].inputs) used[static_cast<size_t>(i)] = true;
  }
  std::vector<int> number(used.size());
  Case kept = c;
  kept.pictures.clear(), kept.steps.clear();
  int next = 0;
  for (size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    number[v] = next++;
    if (v < c.pictures.size()) {
      kept.pictures.push_back(c.pictures[v]);
    } else {
      kept.steps.push_back(c.steps[v - c.pictures.size()]);
      for (int& i : kept.steps.back().inputs) i = number[static_cast<size_t>(i)];
    }
  }
  c = std::move(kept);
}

// A case while it grows. Pictures are added on the way, so until the end they are numbered apart: -1, -2, ...
struct Generator::State {
  Case made;
  std::vector<Node> pictures, steps;
  Roi window;             // what pictures have
  bool complete = false;  // has its pictures

  const Node& At(int value) const {
    return value < 0 ? pictures[static_cast<size_t>(-1 - value)] : steps[static_cast<size_t>(value)];
  }
  int AddPicture(const Picture& picture) {
    made.pictures.push_back(picture);
    // Pixels do not matter to the nodes' construction.
    pictures.push_back(FromImage(Image(SpecOf(picture))));
    return -static_cast<int>(pictures.size());
  }
};

Generator::Generator(std::vector<const OpInfo*> rows, const std::string& folder, Tally& tally)
    : rows_(std::move(rows)), words_(rows_, folder), tally_(tally) {
  for (const OpInfo* op : rows_) {
    const graph::OpKind kind = KindOf(*op);
    if (kind == graph::OpKind::kTile || kind == graph::OpKind::kWhole) tiles_.push_back(op);
    if (kind == graph::OpKind::kChannel || kind == graph::OpKind::kColor) points_.push_back(op);
    if (kind == graph::OpKind::kColor && op->inputs == 2) pairs_.push_back(op);
    if (kind == graph::OpKind::kChannel && op->inputs == 2) sample_pairs_.push_back(op);
    if (op->name == "ccmatrix" || op->name == "saturate" || op->name == "hue") grades_.push_back(op);
    for (const char* quick : {"blur", "sobel", "resize", "shift", "zoom", "dilate", "convolve"}) {
      if (op->name == quick) quick_.push_back(op);
    }
    for (const char* whole : {"equalize", "blur", "lic"}) {
      if (op->name == whole) wholes_.push_back(op);
    }
    for (const char* move : {"ch", "chappend", "chnames", "crop"}) {
      if (op->name == move) moves_.push_back(op);
    }
    if (op->name == "clamp") clamp_ = op;
  }
}

const OpInfo& Generator::DrawRow(Draw& draw, const std::vector<const OpInfo*>& rows) const {
  for (;;) {
    const OpInfo& op = *draw.Of(rows);
    if (draw.Chance(WeightOf(op))) return op;
  }
}

bool Generator::AddStep(Draw& draw, const OpInfo& op, State& s, bool plain) {
  Step step;
  step.op = &op;
  Surroundings around{4, s.window.width(), s.window.height()};
  if (!s.steps.empty()) {
    const ImageSpec& spec = s.steps.back().spec();
    around = {spec.channel_count(), spec.width(), spec.height()};
  } else if (!s.pictures.empty()) {
    around.channels = s.pictures[0].spec().channel_count();
  }
  if (!plain) {
    step.words = words_.Drawn(draw, op, around);
  } else if (&op == clamp_) {  // without a word it limits nothing
    step.words.modifiers = {{"min", "0"}, {"max", "1"}};
  }
  const size_t pictures_before = s.pictures.size();
  const auto undo = [&] {
    s.pictures.resize(pictures_before);
    s.made.pictures.resize(pictures_before);
    return false;
  };
  try {
    const ops::Arguments arguments = Parsed(op, step.words);
    step.window = s.window;
    step.channels = DrawChannels(draw);
    std::vector<Node> inputs;
    for (int k = 0; k < op.Operands(arguments); ++k) {
      // The newest result nearly always; further operands of the same window, shared or new.
      int value = 0;
      const Roi window = inputs.empty() ? s.window : inputs[0].spec().data_window;
      std::vector<int> fitting;
      for (int v = 0; v < static_cast<int>(s.steps.size()); ++v) {
        if (s.At(v).spec().data_window == window) fitting.push_back(v);
      }
      for (int v = 1; v <= static_cast<int>(s.pictures.size()); ++v) {
        if (s.At(-v).spec().data_window == window) fitting.push_back(-v);
      }
      if (!s.steps.empty() && (k == 0 ? draw.Chance(0.93) : draw.Chance(0.2))) {
        value = static_cast<int>(s.steps.size()) - 1;
      } else if (!fitting.empty() && (s.complete || draw.Chance(0.65))) {
        value = draw.Of(fitting);
      } else {
        Picture picture = DrawPicture(draw, draw.Chance(0.04) ? DrawWindow(draw) : window);
        if (!inputs.empty() && draw.Chance(0.8)) picture.channels = inputs[0].spec().channel_count();
        value = s.AddPicture(picture);
      }
      step.inputs.push_back(value);
      inputs.push_back(s.At(value));
    }
    ImageSpec spec;
    if (op.generator) {
      spec = ImageSpec(step.window.width(), step.window.height(), step.channels);
      spec.data_window = spec.display_window = step.window;
    }
    const Node node = op.make(inputs, arguments, op.generator ? &spec : nullptr);
    const int64_t most = s.made.large ? kMostOfLarge : kMostSamples;
    if (node.spec().data_window.pixels() * node.spec().channel_count() > most ||
        node.spec().data_window.empty()) {
      tally_.Add(kTooLarge, op.name);
      return undo();
    }
    s.steps.push_back(node);
    s.made.steps.push_back(step);
    tally_.Add(kAccepted, op.name);
    return true;
  } catch (const Error&) {
    tally_.Add(kRefused, op.name);
    return undo();
  }
}

void Generator::DrawChecks(Draw& draw, Case& c, const Node& result) const {
  constexpr struct {
    Check check;
    double share;
  } kShares[] = {{Check::kRules, 1},    {Check::kEachRule, 1},   {Check::kTypes, 1},
                 {Check::kTiles, 0.7},  {Check::kThreads, 0.15}, {Check::kShuffle, 0.15},
                 {Check::kPixels, 0.6}, {Check::kStream, 0.35},  {Check::kFile, 0.08},
                 {Check::kEager, 0.3},  {Check::kTargets, 0.3},  {Check::kReference, 0.1},
                 {Check::kPlain, 0.03}, {Check::kVerify, 0.03}};
  for (const auto& [check, share] : kShares) {
    if (draw.Chance(share)) c.checks |= Bit(check);
  }
  if (c.index % 3 == 0) c.checks |= Bit(Check::kJson);
  if (c.index % 4 == 0) c.checks |= Bit(Check::kPaged);
  const ImageSpec& spec = result.spec();
  if (!c.pictures.empty() && draw.Chance(0.5) && OnlyPointsBelow(result) &&
      spec.data_window == c.pictures[0].window && spec.channel_count() == c.pictures[0].channels) {
    c.checks |= Bit(Check::kInPlace);
  }
  // Floats overflow where doubles do not, so verdicts are about ordinary values.
  if (!std::all_of(c.pictures.begin(), c.pictures.end(),
                   [](const Picture& p) { return IsOrdinary(p.content); }))
    c.checks &= ~Bit(Check::kVerify);
  // Spectra are computed for two channels at a time: which two follows from those that are needed.
  const auto is_spectral = [](const Step& step) {
    return std::any_of(step.words.modifiers.begin(), step.words.modifiers.end(),
                       [](const auto& m) { return m.second == "fft"; });
  };
  if (std::any_of(c.steps.begin(), c.steps.end(), is_spectral)) c.checks &= ~Bit(Check::kEager);
  const int shape = draw.Below(5);
  const int w = spec.width(), h = spec.height();
  c.tile_width = shape == 0 ? draw.Between(1, 3) : shape == 1 ? draw.Between(3, 40) : draw.Between(1, w + 3);
  c.tile_height = shape == 0 ? draw.Between(1, 3) : shape == 2 ? 1 : draw.Between(1, h + 2);
  // Many tiny tiles of a large image only take time.
  while (int64_t{w} * h / (int64_t{c.tile_width} * c.tile_height) > 400) c.tile_width *= 2, ++c.tile_height;
  c.threads = draw.Between(2, 3);
  c.layout = DrawLayout(draw);
  c.partial = draw.Chance(0.4);
  // Whole images are made in the caller's pixels where those are floats, side by side, and all of them.
  if (result.data()->op->Kind() == graph::OpKind::kWhole && draw.Chance(0.6)) {
    c.type = PixelType::kFloat, c.layout = {};
    c.checks |= Bit(Check::kPixels);
  }
  c.format = spec.channel_count() < 3 ? draw.Of({"tif", "png", "png", "sgi"})
                                      : draw.Of({"tif", "png", "png", "sgi", "tga", "dpx"});
  const bool deep = c.type == PixelType::kHalf || c.type == PixelType::kFloat;
  if (deep) c.format = draw.Of({"exr", "exr", "tif"});
  if (c.type == PixelType::kUint8 && spec.channel_count() == 3) {  // all that some formats have
    c.format = draw.Of({"bmp", "ppm", "tga", "png", "sgi", "dpx"});
    if (draw.Chance(0.3)) c.checks |= Bit(Check::kFile);
  }
  const int rules = static_cast<int>(RewriteRules().size());
  c.rules = draw.Chance(0.15) ? rules : std::min(rules, 2);
  c.first_rule = rules > 0 ? draw.Below(rules) : 0;
}

// A case that has grown, with pictures numbered first.
Case Generator::Finished(Draw& draw, State& s) const {
  if (s.steps.empty()) {  // nothing was accepted: a copy
    static const OpInfo& kCopy = *ops::FindOp("addc");
    Step step;
    step.op = &kCopy, step.words.positional = {"0"}, step.inputs = {-1};
    s.made.steps.push_back(step);
    s.steps.push_back(kCopy.make(std::vector{s.pictures[0]}, Parsed(kCopy, step.words), nullptr));
  }
  Case& c = s.made;
  for (Step& step : c.steps) {
    for (int& i : step.inputs) i = i < 0 ? -1 - i : i + static_cast<int>(c.pictures.size());
  }
  Prune(c);
  DrawChecks(draw, c, s.steps.back());
  return c;
}

// A few quick operations on an image whose result is too large for a cache.
Case Generator::MakeLarge(uint64_t seed, uint64_t index, Draw& draw, const OpInfo* only) {
  State s;
  s.made.seed = seed, s.made.index = index, s.made.large = true;
  s.made.type = draw.Of(
      {PixelType::kFloat, PixelType::kFloat, PixelType::kHalf, PixelType::kUint16, PixelType::kUint8});
  Picture picture = DrawPicture(draw, {0, 0, 1, 1});
  const int width = draw.Between(700, 1500);
  const double row =
      static_cast<double>(width) * picture.channels * static_cast<double>(PixelBytes(s.made.type));
  const int x = draw.Chance(0.5) ? 0 : draw.Between(-40, 40);
  picture.window = s.window = {x, 0, x + width, 1 + static_cast<int>(kLargeBytes / row)};
  // Bytes that are only moved go around the cache in a way of their own.
  const bool moves = draw.Chance(0.35) && !moves_.empty();
  if (moves) picture.type = s.made.type, picture.layout = {};
  s.AddPicture(picture);
  for (int k = 0, steps = draw.Between(1, moves ? 2 : 3); k < steps; ++k) {
    const auto& rows = moves                                           ? moves_
                       : k == 0 && draw.Chance(0.4) && !quick_.empty() ? quick_
                       : points_.empty()                               ? rows_
                                                                       : points_;
    for (int attempt = 0; attempt < 30; ++attempt) {
      if (AddStep(draw, only != nullptr && k == 0 && attempt < 3 ? *only : DrawRow(draw, rows), s)) break;
    }
  }
  return Finished(draw, s);
}

// From packed pixels to packed pixels of the same type, in one operation or in colours that follow each
// other: the rules that need just that come too rarely by chance.
Case Generator::MakePacked(uint64_t seed, uint64_t index, Draw& draw) {
  State s;
  s.made.seed = seed, s.made.index = index, s.complete = true;
  s.window = DrawWindow(draw);
  const int kind = draw.Below(8);
  const bool colors = kind == 0 && !pairs_.empty(), samples = kind == 6 && !sample_pairs_.empty();
  const bool pair = colors || samples, moves = kind == 7 && !moves_.empty();
  s.made.type = draw.Of({PixelType::kUint8, PixelType::kUint16});
  if ((pair || moves) && draw.Chance(0.4)) s.made.type = draw.Of({PixelType::kHalf, PixelType::kFloat});
  const int alike = draw.Chance(0.4) ? 4 : DrawChannels(draw);
  const int pictures = moves ? draw.Between(1, 4) : pair ? 2 : 1;
  for (int k = 0; k < pictures; ++k) {
    Picture picture = DrawPicture(draw, s.window);
    picture.channels = samples ? alike : moves ? draw.Between(1, 2) : draw.Chance(0.9) ? 4 : picture.channels;
    picture.type = s.made.type, picture.layout = {};
    s.AddPicture(picture);
  }
  const auto add = [&](const std::vector<const OpInfo*>& rows, bool plain) {
    if (rows.empty()) return;
    for (int attempt = 0; attempt < 10; ++attempt) {
      if (AddStep(draw, DrawRow(draw, rows), s, plain && attempt == 0)) return;
    }
  };
  if (moves) {
    const auto append =
        std::find_if(moves_.begin(), moves_.end(), [](const OpInfo* op) { return op->inputs == 2; });
    for (int k = 1; k < pictures && append != moves_.end(); ++k) add({*append}, false);
    for (int k = draw.Between(pictures > 1 ? 0 : 1, 2); k > 0; --k) add(moves_, false);
  } else if (pair) {
    add(colors ? pairs_ : sample_pairs_, draw.Chance(0.5));
  } else if (kind == 1) {
    const int rows = draw.Below(3);
    add(rows == 0 ? tiles_ : rows == 1 ? quick_ : wholes_, false);
  } else {
    add(grades_, false);
    if (kind > 2) {
      if (clamp_ != nullptr) AddStep(draw, *clamp_, s, draw.Chance(0.7));
      add(grades_, false);
      // What lies between two colours may be read by something else, too.
      if (draw.Chance(0.4)) add(draw.Chance(0.5) ? sample_pairs_ : pairs_, true);
    }
  }
  return Finished(draw, s);
}

Case Generator::Make(uint64_t seed, uint64_t index, const OpInfo* only) {
  Draw draw(seed, index);
  if (index % kLargeEvery == kFirstLarge) return MakeLarge(seed, index, draw, only);
  if (only == nullptr && draw.Chance(0.2)) return MakePacked(seed, index, draw);
  State s;
  s.made.seed = seed, s.made.index = index;
  s.window = DrawWindow(draw);
  int steps = 1 + draw.Weighted({26, 24, 17, 12, 8, 6, 4, 3});
  // A window or gather, then points, is what people do most; and a way through the engine of its own.
  const bool tile_then_points = draw.Chance(0.25) && !tiles_.empty() && !points_.empty();
  // So are colours by matrices, with clamps between them.
  const bool grades = !tile_then_points && draw.Chance(0.1) && !grades_.empty();
  if (grades) steps = std::max(steps, 4);
  const int pictures = draw.Weighted({0, 70, 22, 8});
  for (int k = 0; k < pictures; ++k) {
    Picture picture = DrawPicture(draw, k == 0 || draw.Chance(0.9) ? s.window : DrawWindow(draw));
    if (grades) picture.channels = draw.Of({3, 4, 4});
    s.AddPicture(picture);
  }
  const int at = only != nullptr ? draw.Below(steps) : -1;
  for (int k = 0; k < steps; ++k) {
    for (int attempt = 0; attempt < 30; ++attempt) {
      const OpInfo* op = only;
      if (k != at) {
        const auto& rows = grades ? grades_ : !tile_then_points ? rows_ : k == 0 ? tiles_ : points_;
        op = grades && k % 2 == 1 && clamp_ != nullptr ? clamp_ : &DrawRow(draw, rows);
        if (op->generator && k + 1 == steps && steps > 1 && draw.Chance(0.9)) continue;
      }
      // Limits of all channels alike are what two matrices may be joined over.
      const bool plain = grades && op == clamp_ && draw.Chance(0.7);
      if (AddStep(draw, *op, s, plain)) break;
    }
  }
  s.made.type = DrawType(draw);
  return Finished(draw, s);
}

}  // namespace tessera::random
