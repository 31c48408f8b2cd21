// Greedy: every simplification that keeps the failure is kept.
#include "random/shrink.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "tessera/error.h"

namespace tessera::random {
namespace {

using Change = std::function<bool(Case&)>;  // false where there is nothing to change

class Shrinker {
 public:
  Shrinker(Case c, const Fails& fails, int tries) : best_(std::move(c)), fails_(fails), tries_(tries) {}

  Case Run() {
    bool any = true;
    while (any && tries_ > 0) {
      any = FewerSteps();
      any = SimplerWords() || any;
      any = SimplerPictures() || any;
      any = SimplerComparison() || any;
    }
    return best_;
  }

 private:
  bool Try(const Change& change) {
    if (tries_ <= 0) return false;
    Case c = best_;
    if (!change(c)) return false;
    Prune(c);
    --tries_;
    if (!fails_(c)) return false;
    best_ = std::move(c);
    return true;
  }

  bool FewerSteps() {
    bool any = false;
    // An earlier value as the result.
    for (size_t n = 1; n < best_.steps.size(); ++n) {
      if (Try([&](Case& c) { return c.steps.resize(n), true; })) {
        any = true;
        break;
      }
    }
    // A step's input in its place, or a picture.
    for (size_t k = 0; k < best_.steps.size(); ++k) {
      for (size_t in = 0; in < best_.steps[k].inputs.size(); ++in) {
        if (best_.steps.size() < 2) break;
        if (Try([&](Case& c) { return Replace(c, k, c.steps[k].inputs[in]); })) {
          any = true;
          k = static_cast<size_t>(-1);
          break;
        }
      }
    }
    for (size_t k = 0; k < best_.steps.size() && best_.steps.size() > 1; ++k) {
      const auto to_picture = [&](Case& c) {
        const Node was = Build(c).values[c.pictures.size() + k];
        Picture p;
        p.window = was.spec().data_window;
        p.channels = was.spec().channel_count();
        p.content = Content::kNoise;
        c.pictures.push_back(p);
        const int added = static_cast<int>(c.pictures.size()) - 1;
        for (Step& s : c.steps) {
          for (int& i : s.inputs) i += i >= added;
        }
        return Replace(c, k, added);
      };
      if (Try(to_picture)) any = true, k = static_cast<size_t>(-1);
    }
    // All operands the same.
    for (size_t k = 0; k < best_.steps.size(); ++k) {
      for (size_t in = 1; in < best_.steps[k].inputs.size(); ++in) {
        any = Try([&](Case& c) {
                int& i = c.steps[k].inputs[in];
                if (i == c.steps[k].inputs[0]) return false;
                i = c.steps[k].inputs[0];
                return true;
              }) ||
              any;
      }
    }
    return any;
  }

  // Everyone who read step k reads `value` instead.
  static bool Replace(Case& c, size_t k, int value) {
    const int old = static_cast<int>(c.pictures.size() + k);
    if (k + 1 == c.steps.size()) {
      if (value < static_cast<int>(c.pictures.size())) return false;
      c.steps.resize(static_cast<size_t>(value) - c.pictures.size() + 1);
      return true;
    }
    for (size_t later = k + 1; later < c.steps.size(); ++later) {
      for (int& i : c.steps[later].inputs) {
        if (i == old) i = value;
      }
    }
    return true;
  }

  bool SimplerWords() {
    bool any = false;
    for (size_t k = 0; k < best_.steps.size(); ++k) {
      for (size_t m = best_.steps[k].words.modifiers.size(); m-- > 0;) {
        if (m >= best_.steps[k].words.modifiers.size()) continue;
        const auto drop = [&](Case& c) {
          auto& modifiers = c.steps[k].words.modifiers;
          modifiers.erase(modifiers.begin() + static_cast<ptrdiff_t>(m));
          return true;
        };
        if (Try(drop)) {
          any = true;
        } else {
          any = SimplerText([&](Case& c) -> std::string& { return c.steps[k].words.modifiers[m].second; }) ||
                any;
        }
      }
      for (size_t p = 0; p < best_.steps[k].words.positional.size(); ++p) {
        any = SimplerText([&](Case& c) -> std::string& { return c.steps[k].words.positional[p]; }) || any;
      }
    }
    return any;
  }

  // A shorter list of numbers; rounder numbers.
  bool SimplerText(const std::function<std::string&(Case&)>& text) {
    bool any = false;
    const auto shorter = [&](Case& c) {
      std::string& t = text(c);
      const size_t comma = t.rfind(',');
      if (comma == std::string::npos) return false;
      t.resize(comma);
      return true;
    };
    const auto rounder = [&](Case& c) {
      std::string& t = text(c);
      const size_t point = t.rfind('.');
      if (point == std::string::npos || point + 2 >= t.size() || t.find('e') != std::string::npos)
        return false;
      if (t.find_first_not_of("0123456789", point + 1) != std::string::npos) return false;
      t.resize(point + 2);
      return true;
    };
    while (Try(shorter)) any = true;
    while (Try(rounder)) any = true;
    return any;
  }

  bool SimplerPictures() {
    bool any = false;
    // One window for all, smaller and smaller.
    const auto window = [&](const std::function<bool(Roi&)>& change) {
      return Try([&](Case& c) {
        bool changed = false;
        for (Picture& p : c.pictures) changed = change(p.window) || changed;
        for (Step& s : c.steps) {
          if (s.op->generator) changed = change(s.window) || changed;
        }
        return changed;
      });
    };
    for (const double share : {0.5, 0.8, 0.95}) {
      while (window([&](Roi& r) {
        const int w = std::max(1, static_cast<int>(r.width() * share));
        return w < r.width() ? (r.x1 = r.x0 + w, true) : false;
      }))
        any = true;
      while (window([&](Roi& r) {
        const int h = std::max(1, static_cast<int>(r.height() * share));
        return h < r.height() ? (r.y1 = r.y0 + h, true) : false;
      }))
        any = true;
    }
    while (window([](Roi& r) { return r.width() > 1 ? (--r.x1, true) : false; })) any = true;
    while (window([](Roi& r) { return r.height() > 1 ? (--r.y1, true) : false; })) any = true;
    any = window([](Roi& r) {
            if (r.x0 == 0 && r.y0 == 0) return false;
            r = {0, 0, r.width(), r.height()};
            return true;
          }) ||
          any;
    for (size_t k = 0; k < best_.pictures.size(); ++k) {
      const auto set = [&](const std::function<bool(Picture&)>& change) {
        any = Try([&](Case& c) { return change(c.pictures[k]); }) || any;
      };
      set([](Picture& p) { return !p.layout.dense() ? (p.layout = {}, true) : false; });
      set([](Picture& p) {
        return p.type != PixelType::kFloat ? (p.type = PixelType::kFloat, true) : false;
      });
      for (const Content simple : {Content::kFlat, Content::kChecker, Content::kNoise}) {
        set([&](Picture& p) { return p.content > simple ? (p.content = simple, true) : false; });
      }
      for (const int channels : {1, 3, 4}) {
        set([&](Picture& p) { return p.channels > channels ? (p.channels = channels, true) : false; });
      }
    }
    return any;
  }

  bool SimplerComparison() {
    bool any = false;
    const auto set = [&](const Change& change) { any = Try(change) || any; };
    set([](Case& c) { return c.type != PixelType::kFloat ? (c.type = PixelType::kFloat, true) : false; });
    set([](Case& c) { return !c.layout.dense() ? (c.layout = {}, true) : false; });
    set([](Case& c) { return c.partial ? (c.partial = false, true) : false; });
    set([](Case& c) { return c.threads > 2 ? (c.threads = 2, true) : false; });
    if (best_.rules > 1) {
      for (int k = 0; k < best_.rules; ++k) {
        const int rule = best_.first_rule + k;
        if (Try([&](Case& c) { return c.first_rule = rule, c.rules = 1, true; })) {
          any = true;
          break;
        }
      }
    }
    return any;
  }

  Case best_;
  const Fails& fails_;
  int tries_;
};

}  // namespace

Case Shrunk(Case c, const Fails& fails, int tries) { return Shrinker(std::move(c), fails, tries).Run(); }

Case ShrunkOf(const Case& c, const Finding& finding, Comparer& comparer, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  const Fails fails = [&](const Case& candidate) {
    // What depends on threads does not fail every time.
    const int times = finding.check == Check::kThreads ? 6 : 1;
    for (int k = 0; k < times && Clock::now() < end; ++k) {
      try {
        const std::optional<Finding> again = comparer.Run(candidate);
        if (again && again->check == finding.check) return true;
      } catch (const Error&) {
        return false;
      }
    }
    return false;
  };
  Case alone = c;
  alone.checks = Bit(finding.check);
  return Shrunk(std::move(alone), fails);
}

}  // namespace tessera::random
