// Whole command lines: words, checks, frames, graphs and their plans. Nothing is computed or written.
#include <unistd.h>

#include <iostream>
#include <sstream>

#include "cli/arguments.h"
#include "cli/frames.h"
#include "cli/help.h"
#include "cli/session.h"
#include "fuzz/fuzz.h"
#include "fuzz/pictures.h"
#include "random/generate.h"

using namespace tessera;

namespace {

std::vector<std::string> WordsOf(std::string_view bytes) {
  constexpr size_t kMostWords = 40;
  fuzz::Input in(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
  std::vector<std::string> words;
  while (!in.empty() && words.size() < kMostWords) {
    words.emplace_back(in.Until('\n'));
    std::erase(words.back(), '\0');  // which ends a word
  }
  return words;
}
std::string LineOf(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : "\n") + word;
  return line;
}

// An operation as the registry has it, with drawn words.
std::vector<std::string> DrawnOperation(random::Draw& draw) {
  static const std::vector<const ops::OpInfo*> kRows = random::RegistryRows();
  static const random::WordSource kWords(kRows, fuzz::Folder());
  const ops::OpInfo& op = *draw.Of(kRows);
  const random::Words drawn = kWords.Drawn(draw, op, {4, 9, 7});
  std::string word = op.generator ? op.name : "--" + op.name;
  for (const auto& [key, value] : drawn.modifiers) {
    const bool quoted = value.find(':') != std::string::npos;
    word += ":" + key + "=" + (quoted ? "\"" + value + "\"" : value);
  }
  if (op.generator) return {"--pattern", word, "9x7", "4"};
  std::vector<std::string> words = {word};
  words.insert(words.end(), drawn.positional.begin(), drawn.positional.end());
  return words;
}

// Inputs of these names are there; a line is run in the folder.
void PrepareFolder() {
  fuzz::PictureFile(".exr", "", PixelType::kHalf, 4, 9, 7);
  fuzz::PictureFile(".png", "", PixelType::kUint8, 3, 9, 7);
  for (const char* name : {"a.exr", "b.exr", "a.1.exr", "a.2.exr"})
    fuzz::File(name).Put(fuzz::Contents(fuzz::Folder() + "/seed.exr"));
  fuzz::Require(::chdir(fuzz::Folder().c_str()) == 0, "the folder is gone");
  std::cout.rdbuf(nullptr);
}

// The plan of the line for its first frames, as --explain prints it.
void Plan(const std::vector<std::string>& words) {
  const cli::Line line = cli::ParseLine(cli::WithFrame(words, 1));
  std::ostringstream out;
  if (line.options.help && !line.options.help_topic.empty())
    cli::PrintCommandHelp(out, line.options.help_topic);
  if (line.options.search) cli::PrintSearch(out, line.options.help_search, {});
  if (line.options.Informs()) return;
  constexpr size_t kMostFrames = 2;
  const std::vector<cli::FrameLine> frames = cli::ExpandFrames(words, line);
  for (size_t i = 0; i < std::min(frames.size(), kMostFrames); ++i) {
    cli::Line own = cli::ParseLine(frames[i].words);
    own.options.dry_run = own.options.explain = true;
    own.options.verbose = false, own.options.quiet = true;
    own.options.render.threads = 1;
    for (cli::Step& step : own.steps) {
      // Files stay in the folder, sizes small.
      for (auto& [name, value] : step.arguments.values) {
        if (name == "FILE" && value.text.find('/') != std::string::npos) return;
      }
      if (!random::IsCheap(step.command->info, step.arguments)) return;
      if (step.generator != nullptr && !random::IsCheap(*step.generator, step.generator_arguments)) return;
    }
    cli::Progress all(1, 1, false);
    cli::Progress::Frame progress(all);
    cli::Session session(own.options, "", progress);
    session.frame = frames[i].frame;
    std::vector<std::string> written;
    session.Compute(own.steps);
    session.Commit(written);
  }
}

}  // namespace

namespace tessera::fuzz {
std::vector<std::string> Seeds() {
  std::vector<std::string> seeds;
  for (
      const char* line :
      {"a.exr --mulc 1.12,1.05,0.95,1 --saturate 1.35 --hue 150 -d half -o out.exr",
       "a.exr b.exr --interp 1.5 --clamp:min=0:max=1 -o sharper.png",
       "--frames 1-2 a.#.exr --saturate 0.8 -o g.#.exr",
       "--pattern checker:width=64:height=64 64x48 3 --pattern ramp 64x48 3 --mul -o test.tif",
       "--frames 1-3 --pattern clouds:time={FRAME_NUMBER/24} 48x27 3 -o clouds.#.png", "--help blur",
       "--simd list", "a.exr --dup --swap --pop --printstats", "a.exr b.exr --diff",
       "--create 9x7+1-2 3 --attrib a b -o a.tif",
       "a.1.exr -i:subimage=0 a.exr --blend multiply --verify:samples=3 --runstats --max-memory 100 -o x.exr",
       "--kernel gaussian 5x5 -o k.exr", "--motionblur:frames=1-2 a.#.exr -o m.exr",
       "--list-commands:format=json"}) {
    std::string seed = line;
    std::replace(seed.begin(), seed.end(), ' ', '\n');
    seeds.push_back(seed);
  }
  random::Draw draw(3, 0);
  for (int i = 0; i < 300; ++i) {
    std::vector<std::string> words = {"a.exr", "b.exr", "a.exr"};
    const std::vector<std::string> operation = DrawnOperation(draw);
    words.insert(words.end(), operation.begin(), operation.end());
    words.insert(words.end(), {"-o", "o.exr"});
    seeds.push_back(LineOf(words));
  }
  return seeds;
}
std::vector<std::string> Words() {
  std::vector<std::string> words;
  for (const std::string& name : cli::CommandNames()) words.push_back("\n--" + name + "\n");
  for (const cli::Command& c : cli::Commands()) {
    for (const ops::ParamInfo& p : c.info.modifiers) words.push_back(":" + p.name + "=");
  }
  words.insert(words.end(), {"\n", "a.exr", "\n-o\nx.exr", "a.#.exr", "%04d", "{FRAME_NUMBER}", "\"", "'",
                             ":", "=", ",", "9x7", "1-2", "--frames\n1-2\n"});
  return words;
}
}  // namespace tessera::fuzz

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const bool prepared = (PrepareFolder(), true);
  static_cast<void>(prepared);
  const std::vector<std::string> words = WordsOf({reinterpret_cast<const char*>(data), size});
  fuzz::Try([&] {
    try {
      Plan(words);
    } catch (const cli::UsageError& e) {
      fuzz::Require(*e.what() != 0, "an error without a reason");
    }
  });
  return 0;
}

// A word or an operation instead of another, before it, or none.
extern "C" size_t LLVMFuzzerCustomMutator(uint8_t* data, size_t size, size_t most, unsigned seed) {
  random::Draw draw(seed, 1);
  std::vector<std::string> words = WordsOf({reinterpret_cast<const char*>(data), size});
  const auto at = [&](size_t n) { return words.begin() + draw.Below(static_cast<int>(n)); };
  switch (words.empty() ? 0 : draw.Below(5)) {
    case 0: {
      const std::vector<std::string> operation = DrawnOperation(draw);
      words.insert(at(words.size() + 1), operation.begin(), operation.end());
      break;
    }
    case 1:
      words.erase(at(words.size()));
      break;
    case 2:
      std::iter_swap(at(words.size()), at(words.size()));
      break;
    case 3: {
      const std::string word = *at(words.size());
      words.insert(at(words.size() + 1), word);
      break;
    }
    default: {  // another modifier of its own
      std::string& word = *at(words.size());
      const cli::Command* const command =
          word.starts_with("--") ? cli::FindCommand(word.substr(2, word.find(':') - 2)) : nullptr;
      if (command == nullptr || command->info.modifiers.empty()) break;
      const ops::ParamInfo& param = draw.Of(command->info.modifiers);
      word += ":" + param.name + "=" + (param.choices.empty() ? param.default_value : draw.Of(param.choices));
    }
  }
  const std::string line = LineOf(words).substr(0, most);
  std::copy(line.begin(), line.end(), data);
  return line.size();
}
