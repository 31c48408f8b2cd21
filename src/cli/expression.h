// Expressions in braces, in oiiotool's grammar: what a word of the line becomes as it runs.
#ifndef TESSERA_CLI_EXPRESSION_H_
#define TESSERA_CLI_EXPRESSION_H_

#include <string>
#include <vector>

namespace tessera::cli {

class Session;

extern const char* const kExpressionHelp;

// Whether a word has braces with something in them.
bool HoldsExpression(const std::string& word);
// The word with every expression replaced by its value. Throws UsageError for what is none.
std::string Evaluate(const std::string& word, Session& session);
// What --if takes for true.
bool IsTrue(const std::string& value);
// A number in words: whole ones in full, others with six digits.
std::string NumberOf(double value);

}  // namespace tessera::cli

#endif  // TESSERA_CLI_EXPRESSION_H_
