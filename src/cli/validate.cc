// Follows the image stack through a line without running it.
#include "cli/validate.h"

#include <algorithm>
#include <set>

namespace tessera::cli {
int Needs(const Step& step) { return step.command->info.Operands(step.arguments); }
namespace {

// How many more images there are after it.
int Growth(const Step& step, int depth) {
  switch (step.command->effect) {
    case Effect::kPush:
    case Effect::kDup:
      return 1;
    case Effect::kApply:
      return 1 - Needs(step);
    case Effect::kPop:
      return -1;
    case Effect::kJoin:
      return 1 - depth;
    default:
      return 0;
  }
}

// -o:all=N.
bool WritesAll(const Step& step) {
  const auto all = step.arguments.values.find("all");
  return step.command->effect == Effect::kUse && all != step.arguments.values.end() && all->second.given;
}

std::string Images(int n) { return std::to_string(n) + (n == 1 ? " image" : " images"); }

// The file a step reads or writes, empty for the others.
std::string FileOf(const Step& step) {
  const auto it = step.arguments.values.find("FILE");
  return it == step.arguments.values.end() || step.command->info.make != nullptr ? "" : it->second.text;
}

struct Slot {
  std::string origin;
  bool used = false;
};

// A file written by a line appears when the whole line has succeeded, so the line cannot read it again.
void CheckFiles(const std::vector<Step>& steps) {
  std::set<std::string> written;
  for (const Step& step : steps) {
    const std::string file = FileOf(step);
    if (file.empty()) continue;
    const bool writes = step.command->effect == Effect::kUse;
    if (written.contains(file)) {
      throw UsageError(
          file, writes ? "is written twice by this line"
                       : "is read after this line wrote it; outputs appear when the whole line is done");
    }
    if (writes) written.insert(file);
  }
}

void CheckSettings(const std::vector<Step>& steps) {
  for (auto it = steps.begin(); it != steps.end(); ++it) {
    if (it->command->effect != Effect::kSetting) continue;
    const std::string& target = it->command->applies_to;
    const bool modifier = target.starts_with(':');
    const auto serves = [&](const Step& s) {
      const ops::OpInfo& info = s.command->info;
      if (!modifier) return info.name == target;
      return std::any_of(info.modifiers.begin(), info.modifiers.end(),
                         [&](const ops::ParamInfo& p) { return p.name == target.substr(1); });
    };
    if (std::none_of(it, steps.end(), serves)) {
      const std::string name =
          modifier ? "command with " + target + "=" : (target.size() == 1 ? "-" : "--") + target;
      throw UsageError(it->written, "no " + name + " comes after it, and it holds only for those that do");
    }
  }
}

}  // namespace

std::vector<Step> OperandsFirst(std::vector<Step> steps) {
  int depth = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    const int missing = Needs(steps[i]) - depth;
    if (missing > 0) {
      const auto is_push = [](const Step& s) { return s.command->effect == Effect::kPush; };
      const size_t end = i + 1 + static_cast<size_t>(missing);
      if (end > steps.size() || !std::all_of(steps.begin() + i + 1, steps.begin() + end, is_push))
        return steps;
      std::rotate(steps.begin() + i, steps.begin() + i + 1, steps.begin() + end);
    }
    depth += Growth(steps[i], depth);
  }
  return steps;
}

void CheckStack(const std::vector<Step>& steps, bool tells_inputs) {
  std::vector<Slot> stack;
  bool any_result = tells_inputs;
  for (const Step& step : steps) {
    const int needs = Needs(step), holds = static_cast<int>(stack.size());
    if (holds < needs) {
      throw UsageError(step.written, "needs " + Images(needs) + ", the stack holds " + std::to_string(holds));
    }
    switch (step.command->effect) {
      case Effect::kOption:
      case Effect::kSetting:
      case Effect::kControl:
        break;
      case Effect::kPrint:
        any_result = true;
        for (Slot& slot : stack) slot.used = true;  // what is printed may be about any of them
        break;
      case Effect::kSplit:
        stack.pop_back();
        stack.insert(stack.end(), static_cast<size_t>(step.pushed), {step.written});
        break;
      case Effect::kJoin:
        stack.assign(1, {step.written});
        break;
      case Effect::kPush:
        stack.push_back({step.generator         ? step.generator->name
                         : FileOf(step).empty() ? step.written
                                                : FileOf(step)});
        break;
      case Effect::kApply:
        stack.resize(stack.size() - static_cast<size_t>(needs));
        stack.push_back({step.written});
        break;
      case Effect::kUse:
        for (int k = 1; k <= needs; ++k) stack[stack.size() - static_cast<size_t>(k)].used = true;
        if (WritesAll(step)) {
          for (Slot& slot : stack) slot.used = true;
        }
        any_result = true;
        break;
      case Effect::kDup:
        stack.push_back(stack.back());
        break;
      case Effect::kSwap:
        std::swap(stack[stack.size() - 1], stack[stack.size() - 2]);
        break;
      case Effect::kPop:
        stack.pop_back();
        break;
    }
  }
  if (steps.empty())
    throw UsageError("command line", "found no image and no command; --help shows how it is used");
  CheckSettings(steps);
  if (!any_result)
    throw UsageError("command line",
                     "no output: found no -o FILE (nor --diff, --printstats, --info or the like)");
  for (const Slot& slot : stack) {
    if (!slot.used && !tells_inputs)
      throw UsageError(slot.origin, "this image is left over with no output; add -o FILE or --pop");
  }
  CheckFiles(steps);
}

}  // namespace tessera::cli
