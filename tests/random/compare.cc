// One way of evaluating a graph against the others.
#include "random/compare.h"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <functional>
#include <set>

#include "graph/op.h"
#include "random/samples.h"
#include "random/verdict.h"
#include "tessera/error.h"
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
constexpr double kMostSeconds = 5, kLongSeconds = 0.5;

// One case with what its comparisons share.
class Comparison {
 public:
  Comparison(const Case& c, const std::string& folder, Tally& tally)
      : c_(c), folder_(folder), tally_(tally), built_(Build(c)) {
    RunStats stats;
    base_ = Limited(node(), {.threads = 1}, &stats);
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
        return DifferRounded(base_.view(), Floats().view(), AnyRuleRounds());
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
      case Check::kVerify:
        return WrongVerdict(node(), base_, c_.index, tally_);
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
  // Where a rule may round, or may have been applied to one of two variants only.
  Words DifferMaybeRounded(const ConstImageView& got, const ConstImageView& want) {
    Words words = Differ(got, want);
    if (words && AnyRuleRounds()) {
      const ConstImageView floats = Floats().view();
      words = Differ(got, want, &floats);
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
  Words CallersPixels() {
    Roi part = node().spec().data_window;
    if (c_.partial) {
      part.x0 += part.width() / 4, part.x1 -= part.width() / 5;
      part.y0 += part.height() / 3, part.y1 -= part.height() / 5;
    }
    const Pixels pixels(part, node().spec().channel_count(), c_.type, c_.layout);
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
    const bool exr = c_.type == PixelType::kHalf || (c_.type == PixelType::kFloat && c_.threads == 2);
    const bool plain =
        spec.data_window == spec.display_window && spec.data_window.x0 == 0 && spec.data_window.y0 == 0;
    const std::set<std::string> names(spec.channels.begin(), spec.channels.end());
    // What is marked as unpremultiplied is multiplied when it is read.
    const bool unassociated =
        spec.metadata != nullptr &&
        std::any_of(spec.metadata->begin(), spec.metadata->end(),
                    [](const Attribute& a) { return a.name == "oiio:UnassociatedAlpha"; });
    if (unassociated) return std::nullopt;
    if ((!exr && !plain) || names.size() < spec.channels.size()) return std::nullopt;
    const std::string file = folder_ + (exr ? "/result.exr" : "/result.tif");
    Write(node(), file, {.type = c_.type, .render = {.threads = c_.threads}});
    const Node read = Read(file);
    if (read.spec().data_window != spec.data_window || read.spec().channel_count() != spec.channel_count() ||
        read.spec().type != c_.type) {
      return "file: another window, type or number of channels was read";
    }
    // Formats have an order of channels of their own.
    const Image image = Render(read, c_.type, {.threads = 1});
    if (exr && read.spec().channels != spec.channels) {
      const Image sorted(base_.spec());
      for (int k = 0; k < spec.channel_count(); ++k) {
        const int at = read.spec().ChannelIndex(spec.channels[static_cast<size_t>(k)]);
        if (at < 0) return "file: channel " + spec.channels[static_cast<size_t>(k)] + " is not there";
        ConstImageView from = image.view();
        ImageView to = sorted.view();
        from.data = from.At(from.roi.x0, from.roi.y0, at), to.data = to.At(to.roi.x0, to.roi.y0, k);
        from.channels = to.channels = 1;
        CopySamples(from, to);
      }
      return Prefixed("file", DifferMaybeRounded(sorted.view(), base_.view()));
    }
    return Prefixed("file", DifferMaybeRounded(image.view(), base_.view()));
  }
  Words InPlace() {
    const Built again = Build(c_);
    const ImageView source = again.pixels[0].view();
    const Image apart = Render(again.result(), source.type, {.threads = 1});
    RenderInto(again.result(), source, {.threads = 1});
    return Prefixed("in place", DifferMaybeRounded(source, apart.view()));
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
    if (comparison->seconds() > kLongSeconds) {
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
