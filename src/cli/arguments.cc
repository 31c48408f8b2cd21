// Reads the words of a line from left to right by the commands' rows. OpenImageIO's ArgParse is not used
// here: it acts on each word as it meets it, stops at the first unknown one with words of its own, knows no
// modifiers and cannot be asked what an option takes; here a line is checked whole, with suggestions, before
// a file is touched.
#include "cli/arguments.h"

#include <algorithm>

#include "cli/control.h"
#include "cli/expression.h"
#include "cli/left_out.h"
#include "cli/validate.h"
#include "ops/wrap.h"
#include "tessera/error.h"

namespace tessera::cli {
namespace {

bool IsCommand(const std::string& word) { return word.size() > 1 && word[0] == '-'; }

std::string WithoutDashes(const std::string& word) {
  return word.substr(std::min(word.find_first_not_of('-'), size_t{2}));
}

// Which arguments of a command are file names, where # and %04d stand for the frame.
bool MayHoldFrame(const Command& command, const ops::ParamInfo& param) {
  return param.type == ops::ParamType::kText && command.effect != Effect::kOption &&
         (param.name == "FILE" || command.info.make != nullptr);
}

bool HasModifier(const Token& token, const std::string& name) {
  return std::any_of(token.modifiers.begin(), token.modifiers.end(),
                     [&](const auto& modifier) { return modifier.first == name; });
}

class LineReader {
 public:
  LineReader(const std::vector<std::string>& words, bool evaluate) : words_(words) {
    line_.options.evaluate = evaluate;
  }

  Line Read() {
    while (next_ < words_.size()) {
      const std::string& word = words_[next_];
      if (IsCommand(word)) {
        ReadCommandAt(next_++);
      } else if (word.empty()) {
        throw UsageError("\"\"", "found an empty word, expected a file name or a command");
      } else {
        if (line_.options.wildcards) line_.file_words.push_back(next_);
        ++next_;
        if (!Defer(ReadCommand(), next_ - 1)) Add(ReadCommand(), word, {}, {word});
      }
    }
    return std::move(line_);
  }

 private:
  void ReadCommandAt(size_t at) {
    const std::string& word = words_[at];
    const Token token =
        SplitToken(WithoutDashes(word));  // a colon in braces may part it wrongly: not its name
    const Command* command = FindCommand(token.name);
    if (command == nullptr) Unknown(token.name);
    const auto& params = command->info.arguments;
    std::vector<std::string> values;
    if (command->optional_argument) {
      if (next_ < words_.size()) values.push_back(words_[next_++]);
    } else {
      for (const ops::ParamInfo& param : params) {
        if (ops::IsLeftOut(param, token.modifiers)) continue;
        if (next_ >= words_.size()) {
          throw UsageError(word, "found the end of the line, expected " + param.name +
                                     (param.help.empty() ? "" : " (" + param.help + ")"));
        }
        RefuseCommand(word, *command, param);
        // The numbers of -o:all=N are those of images.
        const bool numbered = command->info.name == "o" && HasModifier(token, "all");
        if (line_.options.wildcards && !numbered && MayHoldFrame(*command, param))
          line_.file_words.push_back(next_);
        values.push_back(words_[next_++]);
      }
    }
    for (size_t i = at; i < next_; ++i) {
      if (command->bearing == Bearing::kRun) line_.run_words.push_back(i);
      if (command->bearing == Bearing::kFrames) line_.frame_words.push_back(i);
    }
    if (!Defer(*command, at)) Add(*command, word, token.modifiers, values);
  }

  // Words from `first` that hold expressions wait until the line runs.
  bool Defer(const Command& command, size_t first) {
    const auto begin = words_.begin() + static_cast<ptrdiff_t>(first),
               end = words_.begin() + static_cast<ptrdiff_t>(next_);
    const auto holds = std::find_if(begin, end, HoldsExpression);
    if (!line_.options.evaluate || holds == end) return false;
    if (command.effect == Effect::kOption)
      throw UsageError(
          *begin, "found the expression " + *holds + ", expected a value: options hold for the whole line");
    Step step;
    step.command = &command;
    step.written = *begin;
    step.deferred.assign(begin, end);
    line_.steps.push_back(std::move(step));
    return true;
  }

  // A command where an argument was to follow: the argument was forgotten. Text of any kind may be a value.
  void RefuseCommand(const std::string& word, const Command& command, const ops::ParamInfo& param) const {
    const std::string& next = words_[next_];
    if (!IsCommand(next) || command.any_text) return;
    const Command* const other = FindCommand(SplitToken(WithoutDashes(next)).name);
    if (other == nullptr) return;
    throw UsageError(word, "found the command " + next + ", expected " + param.name +
                               (param.help.empty() ? "" : " (" + param.help + ")"));
  }

  [[noreturn]] static void Unknown(const std::string& name) {
    if (const std::string use = WhyLeftOut(name); !use.empty())
      throw UsageError((name.size() == 1 ? "-" : "--") + name,
                       "a command of oiiotool that is not here; " + use);
    const std::vector<std::string> names = CommandNames();
    const std::string near = ops::Nearest(name, names);
    throw UsageError("--" + name, near.empty() ? "unknown command, --help lists them all"
                                               : "unknown command; did you mean --" + near + "?");
  }

  void Add(const Command& command, const std::string& written, const Modifiers& modifiers,
           std::vector<std::string> values) {
    Step step;
    step.command = &command;
    step.written = written;
    try {
      if (command.info.name == "pattern") FindGenerator(values, step);
      if (command.optional_argument) {
        if (!values.empty()) step.arguments.values[command.info.arguments[0].name].text = values[0];
      } else {
        step.arguments = command.by_channel && !values.empty() && !ByChannel(values[0]).empty()
                             ? WithChannels(command, values[0], modifiers)
                             : WithEmptyTexts(command, values, modifiers);
      }
    } catch (const Error& e) {
      throw UsageError((command.info.name.size() == 1 ? "-" : "--") + e.subject(),
                       e.reason() + ModifiersBehind(command.info, values));
    }
    if (command.effect == Effect::kOption) {
      command.set(step.arguments, line_.options);
    } else {
      line_.steps.push_back(std::move(step));
    }
  }

  // Each choice is checked by itself.
  static ops::Arguments WithChannels(const Command& command, const std::string& text,
                                     const Modifiers& modifiers) {
    ops::Arguments arguments;
    for (const auto& [channel, choice] : ByChannel(text)) {
      if (channel.empty())
        throw Error(command.info.name, "found \"" + text + "\", expected a channel before each =");
      arguments = ops::ParseArguments(command.info, std::vector{choice}, modifiers);
    }
    arguments.values[command.info.arguments[0].name].text = text;
    return arguments;
  }

  // A text may be empty where any text is taken (--attrib NAME "" erases), but for a file's name.
  static ops::Arguments WithEmptyTexts(const Command& command, std::vector<std::string> values,
                                       const Modifiers& modifiers) {
    std::vector<size_t> empty;
    for (size_t i = 0; command.any_text && i < std::min(values.size(), command.info.arguments.size()); ++i) {
      if (values[i].empty() && command.info.arguments[i].type == ops::ParamType::kText)
        empty.push_back(i), values[i] = "-";
    }
    ops::Arguments arguments = ops::ParseArguments(command.info, values, modifiers);
    for (const size_t i : empty) arguments.values[command.info.arguments[i].name].text.clear();
    return arguments;
  }

  // --pattern NAME:key=value: the modifiers belong to the generator.
  static void FindGenerator(std::vector<std::string>& values, Step& step) {
    const Token token = SplitToken(values[0]);
    std::vector<std::string> names;
    for (const ops::OpInfo* generator : Generators()) {
      names.push_back(generator->name);
      if (generator->name == token.name) step.generator = generator;
    }
    if (step.generator == nullptr) {
      const std::string near = ops::Nearest(token.name, names);
      std::string known;
      for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
      throw Error("pattern",
                  "unknown pattern \"" + token.name + "\"" +
                      (near.empty() ? ", known ones are " + known : "; did you mean " + near + "?"));
    }
    try {
      step.generator_arguments = ops::ParseArguments(*step.generator, {}, token.modifiers);
    } catch (const Error& e) {
      throw Error("pattern " + e.subject(), e.reason());
    }
  }

  const std::vector<std::string>& words_;
  size_t next_ = 0;
  Line line_;
};

}  // namespace

std::string ModifiersBehind(const ops::OpInfo& row, const std::vector<std::string>& values) {
  for (const std::string& value : values) {
    const size_t colon = std::min(value.find(':'), value.size());
    const std::string key = value.substr(std::min(colon + 1, value.size()));
    const auto begins = [&](const ops::ParamInfo& p) {
      const std::vector<std::string> others = ops::OtherNames(p);
      return key.starts_with(p.name) ||
             std::any_of(others.begin(), others.end(),
                         [&](const std::string& other) { return key.starts_with(other); });
    };
    if (std::any_of(row.modifiers.begin(), row.modifiers.end(), begins)) {
      return "; modifiers follow the name: --" + row.name + value.substr(colon) + " " +
             value.substr(0, colon);
    }
  }
  return "";
}

std::vector<std::pair<std::string, std::string>> ByChannel(const std::string& text) {
  std::vector<std::pair<std::string, std::string>> items;
  if (text.find('=') == std::string::npos) return items;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = text.substr(begin, end - begin);
    const size_t equals = std::min(item.find('='), item.size());
    items.emplace_back(item.substr(0, equals), item.substr(std::min(equals + 1, item.size())));
    begin = end + 1;
  }
  return items;
}

Token SplitToken(const std::string& word) {
  // Pieces between colons; a quote protects what it encloses.
  std::vector<std::string> pieces(1);
  char quote = 0;
  for (char c : word) {
    if (quote != 0 && c == quote) {
      quote = 0;
    } else if (quote == 0 && (c == '"' || c == '\'')) {
      quote = c;
    } else if (quote == 0 && c == ':') {
      pieces.emplace_back();
    } else {
      pieces.back() += c;
    }
  }
  if (quote != 0) throw UsageError(word, "found an opening quote without a closing one");
  Token token{pieces[0], {}};
  for (size_t i = 1; i < pieces.size(); ++i) {
    const size_t equals = pieces[i].find('=');
    token.modifiers.emplace_back(pieces[i].substr(0, equals),
                                 equals == std::string::npos ? "" : pieces[i].substr(equals + 1));
  }
  return token;
}

Line ParseLine(const std::vector<std::string>& words) {
  Line line = LineReader(words, true).Read();
  const Options& o = line.options;
  if (o.batch && !o.Informs()) {
    if (!line.steps.empty()) {
      throw UsageError(line.steps[0].written,
                       "found beside --batch, expected options alone: images and commands come from standard "
                       "input, one line a job");
    }
  } else if (!o.Informs()) {
    const Blocks blocks(line.steps);
    if (IsKnownAhead(line.steps)) {
      line.steps = OperandsFirst(std::move(line.steps));
      CheckStack(line.steps, o.TellsInputs());
    }
  }
  return line;
}

std::vector<std::string> HistoryWords(const std::vector<std::string>& words, const Line& line) {
  std::vector<std::string> kept;
  const auto tells = [&](size_t i) {
    return std::find(line.run_words.begin(), line.run_words.end(), i) == line.run_words.end();
  };
  for (size_t i = 0; i < words.size(); ++i) {
    if (!tells(i)) continue;
    if (!line.options.sans_attributes) {
      kept.push_back(words[i]);
      continue;
    }
    const std::string name = IsCommand(words[i]) ? WithoutDashes(words[i]) : "";
    const std::string plain = name.substr(0, name.find(':'));
    if (plain == "attrib" || plain == "sattrib") {
      i += 2;
    } else if (plain != "sansattrib") {
      kept.push_back(words[i]);
    }
  }
  return kept;
}

Step ParseStep(const std::vector<std::string>& words) {
  Line line = LineReader(words, false).Read();
  if (line.steps.size() != 1)
    throw UsageError(words[0], "found more words than it takes once its expressions are replaced");
  return std::move(line.steps[0]);
}

}  // namespace tessera::cli
