// The one list of operations. Command line, help, reference page, laws test and benchmarks are made from it.
#ifndef TESSERA_OPS_REGISTRY_H_
#define TESSERA_OPS_REGISTRY_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "tessera/export.h"
#include "tessera/node.h"

TESSERA_API_BEGIN
namespace tessera::ops {

enum class ParamType : uint8_t {
  kNumber,  // one finite number in [min, max]
  kInteger,
  kFlag,     // 0 or 1; a bare modifier means 1
  kNumbers,  // comma-separated finite numbers, count in [min_count, max_count]
  kChoice,   // one of `choices`; where `numbers_too` is set, a list of numbers is accepted as well
  kText,
};

struct ParamInfo {
  std::string name;
  ParamType type = ParamType::kNumber;
  std::string default_value;  // empty for a positional argument: required
  std::string help;           // one line, with the unit
  double min = -1e38, max = 1e38;
  int min_count = 1, max_count = 1;
  std::vector<int> counts = {};  // kNumbers: when not empty, the only counts allowed (9,12,16,20)
  std::vector<std::string> choices = {};
  bool numbers_too = false;
  // Where it has a use; written elsewhere it is refused, and a positional argument with a default is left out
  // of the line. Blank-separated, all must hold: "mode=linear|exp" (that parameter has one of these values),
  // "table" (that modifier is written), and either with a ! before it for the opposite. A flag counts as
  // written where it is not its default.
  std::string only_with = {};
};

// Parsed and range-checked values, by parameter name; every parameter of the row is present.
class Arguments {
 public:
  double Number(const std::string& name) const;
  int Integer(const std::string& name) const;
  bool Flag(const std::string& name) const;
  const std::vector<double>& Numbers(const std::string& name) const;
  const std::string& Text(const std::string& name) const;  // kChoice, kText: as written
  bool Given(const std::string& name) const;               // written by the user, not the default

  // Where not null, `make` adds what the user asked to be told about the result (the error of a baked
  // transform).
  std::vector<std::string>* notes = nullptr;

  struct Value {
    std::string text;
    std::vector<double> numbers;
    bool given = false;
  };
  std::map<std::string, Value> values;
};

struct OpInfo {
  std::string name;        // the command without dashes; for a generator the --pattern name
  std::string family;      // the folder: color, arithmetic, generate, channels
  bool generator = false;  // no operands; made with geometry arguments x,y,width,height,channels
  int inputs = 1;          // operands popped, first below last
  int (*operands)(const Arguments&) = nullptr;  // where their number depends on the arguments; null: `inputs`
  int Operands(const Arguments& a) const { return operands != nullptr ? operands(a) : inputs; }
  std::vector<ParamInfo> arguments;  // positional, in order
  std::vector<ParamInfo> modifiers;  // :key=value
  std::string summary;               // one line
  std::string help;                  // paragraphs: formula, channels, ranges, hard cases, source
  std::string bound;                 // the accuracy bound in words
  double bound_u = 0;                // bound = bound_u * 2^-24 * the reference's scale
  // The node; throws Error. For generators the inputs are empty and `output` gives windows and channels.
  Node (*make)(std::span<const Node> inputs, const Arguments&, const ImageSpec* output) = nullptr;
  // Argument lines for the laws test and the benchmarks, first the typical one: positional arguments then
  // key=value, blank-separated ("30 preserve=luminance").
  std::vector<std::string> examples;
  std::string identity;  // the example that returns the input's bits, empty when there is none
};

// All rows, in the order of the help: the library's own, and those of the components that a program has.
const std::vector<OpInfo>& Registry();
// Rows that a library above this one brings as it is loaded; listed behind the row of that name. Rows that
// were handed out before stay where they are.
struct Component {
  const char* name;
  const char* behind;
  std::vector<OpInfo> (*rows)();
};
void AddComponent(const Component& component);
const OpInfo* FindOp(const std::string& name);
// Checks and converts; throws Error(subject, reason) that names the parameter, what was found, what was
// expected and, for an unknown key or choice, the nearest known one.
Arguments ParseArguments(const OpInfo& op, std::span<const std::string> positional,
                         std::span<const std::pair<std::string, std::string>> modifiers);
// ParamInfo::only_with in words, "only with mode=linear or mode=exp, not with table="; empty for none.
std::string UseOf(const ParamInfo& param);
// Whether a positional argument is left out of a line with these modifiers.
bool IsLeftOut(const ParamInfo& param, std::span<const std::pair<std::string, std::string>> modifiers);
// Throws the Error that ParseArguments would throw for this one value.
void CheckValue(const OpInfo& op, const ParamInfo& param, const std::string& text);
// One of OpInfo::examples in words, and as arguments.
struct Words {
  std::vector<std::string> positional;
  std::vector<std::pair<std::string, std::string>> modifiers;
};
Words SplitExample(const OpInfo& op, const std::string& example);
Arguments ParseExample(const OpInfo& op, const std::string& example);
// The nearest of `known` by edit distance, or empty when nothing is near.
std::string Nearest(const std::string& word, std::span<const std::string> known);

}  // namespace tessera::ops
TESSERA_API_END

#endif  // TESSERA_OPS_REGISTRY_H_
