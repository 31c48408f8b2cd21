// One way of evaluating a graph against the others.
#include "random/compare.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <set>

#include "graph/op.h"
#include "random/foreign.h"
#include "random/samples.h"
#include "random/verdict.h"
#include "tessera/color_state.h"
#include "tessera/context.h"
#include "tessera/error.h"
#include "tessera/graph_json.h"
#include "tessera/io.h"
#include "tessera/targets.h"

namespace tessera::random {
namespace {

using Words = std::optional<std::string>;

bool AnyRuleRounds() {
  return std::any_of(RewriteRules().begin(), RewriteRules().end(),
                     [](const RuleInfo& r) { return r.rounds; });
}

Words Prefixed(const std::string& variant, const Words& words) {
  return words ? Words(variant + ": " + *words) : std::nullopt;
}

using Clock = std::chrono::steady_clock;
double SecondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}
// A case that takes longer is given up, and one that took so long is not compared in further ways.
constexpr double kMostSeconds = 5;
double LongSeconds(const Case& c) { return c.large ? 3 : 0.5; }

// One case with what its comparisons share.
class Comparison {
 public:
  Comparison(const Case& c, const std::string& folder, Tally& tally)
      : c_(c), folder_(folder), tally_(tally), built_(Build(c)) {
    RunStats stats;
    base_ = Limited(node(), {.threads = 1}, &stats);
    const int64_t bytes = base_.spec().data_window.pixels() * base_.spec().channel_count() *
                          static_cast<int64_t>(PixelBytes(c.type));
    if (bytes > int64_t{8} << 20) tally_.Add(kCases, "above 8 MB");
    for (const std::string& rule : std::set<std::string>(stats.rules.begin(), stats.rules.end()))
      tally_.Add(kApplied, rule);
  }
  double seconds() const { return SecondsSince(start_); }

  Words Of(Check check) {
    switch (check) {
      case Check::kRules:
        return Rules();
      case Check::kEachRule:
        return EachRule();
      case Check::kTypes:
        if (c_.type == PixelType::kFloat) return std::nullopt;
        return DifferRounded(base_.view(), Floats().view(), AnyRuleRounds(), Off());
      case Check::kTiles:
        return Against("tiles of " + std::to_string(c_.tile_width) + "x" + std::to_string(c_.tile_height),
                       {.threads = 1, .tile_width = c_.tile_width, .tile_height = c_.tile_height});
      case Check::kThreads:
        return Against(std::to_string(c_.threads) + " threads",
                       {.threads = c_.threads, .tile_width = c_.tile_width, .tile_height = c_.tile_height});
      case Check::kShuffle:
        return Against("shuffled tiles",
                       {.tile_width = c_.tile_width, .tile_height = c_.tile_height, .shuffle_tiles = true});
      case Check::kPixels:
        return CallersPixels();
      case Check::kStream:
        return Stream();
      case Check::kFile:
        return File();
      case Check::kInPlace:
        return InPlace();
      case Check::kEager:
        return DifferEager(Build(c_, Backing::kFloats));
      case Check::kTargets:
        return Targets();
      case Check::kReference:
        return BeyondReference(built_, tally_);
      case Check::kPlain:
        return PlainTarget();
      case Check::kVerify:
        return Verdict();
      case Check::kJson:
        return ThroughJson();
      case Check::kPaged:
        return Paged();
      case Check::kCount:
        break;
    }
    return std::nullopt;
  }

 private:
  const Node& node() const { return built_.result(); }
  // Render, or Cancelled where the case has taken too long.
  Image Limited(const Node& of, RenderOptions options, RunStats* stats = nullptr) const {
    return Limited(of, c_.type, std::move(options), stats);
  }
  Image Limited(const Node& of, PixelType type, RenderOptions options, RunStats* stats = nullptr) const {
    options.progress = Progress();
    return Render(of, type, options, stats);
  }
  std::function<bool(double)> Progress() const {
    return [start = start_](double) { return SecondsSince(start) < kMostSeconds; };
  }
  const Image& Floats() {
    if (floats_.view().data == nullptr)
      floats_ = Limited(node(), PixelType::kFloat, {.threads = 1, .rules_off = {"all"}});
    return floats_;
  }
  // How far the operations' own bounds let a sample be off: asked where codes differ, which is rare.
  OffFunction Off() const { return Tolerances(node()); }
  // Where a rule may round, or may have been applied to one of two variants only.
  Words DifferMaybeRounded(const ConstImageView& got, const ConstImageView& want) {
    Words words = Differ(got, want);
    if (words && AnyRuleRounds()) {
      const ConstImageView floats = Floats().view();
      words = Differ(got, want, &floats, Off());
    }
    return words;
  }
  Words Against(const std::string& variant, const RenderOptions& options) {
    return Prefixed(variant, Differ(Limited(node(), options).view(), base_.view()));
  }

  Words Rules() {
    const Image off = Limited(node(), {.threads = 1, .rules_off = {"all"}});
    Words words = Prefixed("rules on against off", DifferMaybeRounded(base_.view(), off.view()));
    if (words || !AnyRuleRounds()) return words;
    std::vector<std::string> rounding;
    for (const RuleInfo& rule : RewriteRules()) {
      if (rule.rounds) rounding.push_back(rule.name);
    }
    const Image exact = Limited(node(), {.threads = 1, .rules_off = rounding});
    return Prefixed("rules that do not round against all off", Differ(exact.view(), off.view()));
  }
  // Whatever is larger than some bytes, of a budget drawn by the case's number.
  Words Paged() {
    Context context({.whole = size_t{1} << c_.index / 4 % 16});
    return Against("paged", {.threads = c_.threads, .context = &context});
  }
  Words EachRule() {
    const auto& rules = RewriteRules();
    for (int k = 0; k < c_.rules; ++k) {
      const RuleInfo& rule = rules[static_cast<size_t>(c_.first_rule + k) % rules.size()];
      tally_.Add(kSwitchedOff, rule.name);
      const Image off = Limited(node(), {.threads = 1, .rules_off = {rule.name}});
      // Where one that rounds is among those that are on, others may keep it from being applied.
      const Words words = DifferMaybeRounded(base_.view(), off.view());
      if (words) return Prefixed("with rule " + rule.name + " against without", words);
    }
    return std::nullopt;
  }
  // Of the window, what the caller asks for.
  Roi Part() const {
    Roi part = node().spec().data_window;
    if (!c_.partial) return part;
    part.x0 += part.width() / 4, part.x1 -= part.width() / 5;
    part.y0 += part.height() / 3, part.y1 -= part.height() / 5;
    return part;
  }
  Words CallersPixels() {
    const Pixels pixels(Part(), node().spec().channel_count(), c_.type, c_.layout);
    pixels.Scribble();
    RenderInto(node(), pixels.view(), {.threads = 1, .progress = Progress()});
    const std::string variant = "caller's " + c_.layout.Words() + (c_.partial ? " in part" : "");
    if (!pixels.GapsAreWhole()) return variant + ": bytes between the pixels were written";
    return Prefixed(variant, DifferMaybeRounded(pixels.view(), base_.view()));
  }
  Words Stream() {
    const Built streamed = Build(c_, Backing::kStreamed);
    const Image image =
        Limited(streamed.result(), {.threads = c_.threads == 3 ? 2 : 1, .tile_height = c_.tile_height});
    return Prefixed("streamed sources", DifferMaybeRounded(image.view(), base_.view()));
  }
  Words File() {
    const ImageSpec& spec = node().spec();
    // What is unpremultiplied is multiplied when it is read.
    if (!ColorStateOf(spec).premultiplied) return std::nullopt;
    const std::string file = folder_ + "/result." + c_.format;
    if (!CanHold(c_.format, spec, c_.type)) {
      const Words words = Padded(file);
      return words ? words : Prefixed("file " + c_.format, WrongAtOrigin(c_, base_, file, tally_));
    }
    if (Words words = WrongFromForeign(c_, base_, folder_ + "/foreign", tally_)) return words;
    const Codec writer = c_.index % 4 == 1 ? Codec::kOpenImageIO : Codec::kAuto,
                reader = c_.index / 4 % 4 == 1 ? Codec::kOpenImageIO : Codec::kAuto;
    if (reader == Codec::kOpenImageIO) tally_.Add(kFiles, "by OpenImageIO");
    PendingOutput output(node(), file, {.type = c_.type, .render = {.threads = c_.threads}, .codec = writer});
    const StoredPixels stored = output.ReadBack();
    if (stored.window != spec.data_window || stored.channels.size() != spec.channels.size() ||
        stored.type != c_.type || stored.bits != 0) {
      return "file: another window, type or number of channels was read back";
    }
    tally_.Add(kFiles, c_.format);
    const Image codes = InOrder(stored);
    Words words =
        Prefixed("file " + c_.format + ", read back", DifferMaybeRounded(codes.view(), base_.view()));
    if (stored.unassociated >= 0 && !AllOpaque(stored)) words = std::nullopt;
    if (words) return words;
    output.Commit();
    if (stored.unassociated >= 0) return Prefixed("file " + c_.format, ByBothCodecs(file));
    const Node read = Read(file, {.codec = reader});
    if (read.spec().data_window != spec.data_window || read.spec().channel_count() != spec.channel_count() ||
        read.spec().type != c_.type) {
      return "file: another window, type or number of channels was read";
    }
    StoredPixels again = stored;  // the order of the file's channels is the same
    const Image image = Render(read, c_.type, {.threads = 1});
    again.read = [&](const ImageView& rows) { CopySamples(image.view(), rows); };
    if (Words wrong =
            Prefixed("file " + c_.format, DifferMaybeRounded(InOrder(again).view(), base_.view()))) {
      return wrong;
    }
    return Prefixed("file " + c_.format, WrongAlone(c_, read, Alone(), Channel(image.view(), Alone())));
  }
  // The channel that is read without the others.
  int Alone() const {
    return static_cast<int>(c_.index / 16 % static_cast<uint64_t>(node().spec().channel_count()));
  }
  // Of colours that are multiplied as they are read, by the library's own reader and by OpenImageIO.
  Words ByBothCodecs(const std::string& file) {
    tally_.Add(kFiles, "of unassociated alpha");
    const Node read = Read(file);
    const Image image = Render(read, c_.type, {.threads = 1});
    const Image other = Render(Read(file, {.codec = Codec::kOpenImageIO}), c_.type, {.threads = 1});
    const Words words = Prefixed("one codec against the other", Differ(image.view(), other.view()));
    return words ? words : WrongAlone(c_, read, Alone(), Channel(other.view(), Alone()));
  }
  // Formats without a data window have all of the display window's pixels, those beyond the data window 0.
  Words Padded(const std::string& file) {
    ImageSpec shown = node().spec();
    const bool reaches = !Intersection(shown.display_window, shown.data_window).empty();
    shown.data_window =
        shown.display_window = {0, 0, shown.display_window.width(), shown.display_window.height()};
    // Of two or four channels the last would be read as alpha.
    const bool plain =
        (c_.format == "png" || c_.format == "sgi") && shown.alpha < 0 && shown.channel_count() % 2 == 1;
    if (!reaches || !plain || !CanHold(c_.format, shown, c_.type)) return std::nullopt;
    return WrongPadding(c_, node(), file, tally_);
  }
  // The held samples with their channels as the result has them.
  Image InOrder(const StoredPixels& stored) const {
    Image held(base_.spec()), sorted(base_.spec());
    stored.read(held.view());
    for (size_t k = 0; k < stored.channels.size(); ++k) {
      ImageView to = sorted.view();
      to.data = to.At(to.roi.x0, to.roi.y0, stored.channels[k]);
      to.channels = 1;
      CopySamples(Channel(held.view(), static_cast<int>(k)), to);
    }
    return sorted;
  }
  // Whether colours were neither divided by alpha nor are to be multiplied by it.
  bool AllOpaque(const StoredPixels& stored) const {
    const int alpha = stored.channels[static_cast<size_t>(stored.unassociated)];
    const Roi& r = base_.spec().data_window;
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x) {
        if (SampleAt(base_.view(), x, y, alpha) != 1) return false;
      }
    }
    return true;
  }
  Words InPlace() {
    const Built again = Build(c_);
    const ImageView source = again.pixels[0].view();
    const Image apart = Render(again.result(), source.type, {.threads = 1});
    RenderInto(again.result(), source, {.threads = 1});
    return Prefixed("in place", DifferMaybeRounded(source, apart.view()));
  }
  Words PlainTarget() {
    std::vector<std::string> plain;
    for (const std::string& target : SimdTargets()) {
      if (target.rfind("AVX", 0) != 0 && target.rfind("NEON", 0) != 0) plain.push_back(target);
    }
    if (plain.empty()) return std::nullopt;
    const std::string& target = plain[c_.index % plain.size()];
    SetSimdTarget(target);
    return Prefixed(target, BeyondReference(Build(c_), tally_));  // whoever asked sets the target back
  }
  Words Verdict() {
    // Of an image, or of whatever pixels the caller has.
    const bool own = c_.index % 2 == 0;
    const Pixels pixels(own ? node().spec().data_window : Part(), node().spec().channel_count(), c_.type,
                        own ? Layout() : c_.layout);
    RenderInto(node(), pixels.view(), {.threads = 1, .progress = Progress()});
    const Words words = WrongVerdict(node(), pixels.view(), c_.index, tally_);
    return own ? words : Prefixed("caller's " + c_.layout.Words(), words);
  }
  Words Targets() {
    Words words;
    for (const std::string& target : SimdTargets()) {
      if (target.rfind("AVX", 0) != 0 || target == SimdTarget() || words) continue;
      SetSimdTarget(target);
      words = Against(target, {.threads = 1});
      SetSimdTarget("auto");
    }
    return words;
  }

  Words ThroughJson() {
    // Rows that a test brings along have no name that a reader could know.
    for (const Step& step : c_.steps) {
      if (ops::FindOp(step.op->name) != step.op) return std::nullopt;
    }
    const GraphJson graph = ToJson(node());
    const Node back = FromJson(graph.text, {graph.inputs.begin(), graph.inputs.end()});
    if (ToJson(back).text != graph.text) return "JSON: other text the second time";
    if (Explain(back, c_.type) != Explain(node(), c_.type)) return "JSON: another plan";
    return Prefixed("JSON", Differ(Limited(back, {.threads = 1}).view(), base_.view()));
  }

  const Clock::time_point start_ = Clock::now();
  const Case& c_;
  const std::string& folder_;
  Tally& tally_;
  const Built built_;
  Image base_;
  Image floats_;
};

}  // namespace

std::optional<Finding> Comparer::Run(const Case& c) {
  std::optional<Comparison> comparison;
  try {
    comparison.emplace(c, folder_, tally_);
  } catch (const Error&) {
    tally_.Add(kCases, "refused");
    return std::nullopt;
  }
  tally_.Add(kCases, "compared");
  std::set<std::string> rows;
  for (const Step& step : c.steps) rows.insert(step.op->name);
  for (const std::string& row : rows) tally_.Add(kCompared, row);
  for (int k = 0; k < static_cast<int>(Check::kCount); ++k) {
    const auto check = static_cast<Check>(k);
    if ((c.checks & Bit(check)) == 0) continue;
    if (comparison->seconds() > LongSeconds(c)) {
      tally_.Add(kCases, "cut short");
      return std::nullopt;
    }
    tally_.Add(kChecked, CheckName(check));
    std::optional<std::string> words;
    try {
      words = comparison->Of(check);
    } catch (const Cancelled&) {
      tally_.Add(kCases, "given up");
    } catch (const Error& e) {
      words = std::string("refused: ") + e.what();
    }
    SetSimdTarget("auto");
    if (words) return Finding{check, *words};
  }
  return std::nullopt;
}

}  // namespace tessera::random
