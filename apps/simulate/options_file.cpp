#include "apps/simulate/options_file.hpp"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <vector>

namespace km {
namespace {

constexpr const char* kBlanks = " \t\r";

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(kBlanks);
  if (begin == text.npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlanks) - begin + 1);
}

// Up to a # that is not between quotation marks.
std::string without_comment(const std::string& line) {
  char quote = 0;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quote != 0)
      quote = c == quote ? '\0' : quote;
    else if (c == '"' || c == '\'')
      quote = c;
    else if (c == '#')
      return line.substr(0, i);
  }
  return line;
}

// The text between quotation marks, or the text itself.
std::string unquoted(const std::string& value) {
  const char quote = value.empty() ? '\0' : value.front();
  if (quote != '"' && quote != '\'') return value;
  if (value.size() < 2 || value.back() != quote)
    throw std::invalid_argument("no closing " + std::string(1, quote));
  return value.substr(1, value.size() - 2);
}

// Elements of [a, b], or the one value.
std::vector<std::string> values_of(const std::string& text) {
  if (text.empty()) throw std::invalid_argument("no value");
  if (text.front() != '[') return {unquoted(text)};
  if (text.back() != ']') throw std::invalid_argument("no closing ]");
  std::vector<std::string> values;
  std::size_t begin = 1;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find(',', begin), text.size() - 1);
    values.push_back(unquoted(trimmed(text.substr(begin, end - begin))));
    begin = end + 1;
  }
  return values;
}

// Throws std::invalid_argument as the option itself would refuse the value.
void check_value(CLI::Option& option, std::string value) {
  if (option.get_expected_max() == 0) {
    try {
      static_cast<void>(CLI::detail::to_flag_value(value));
    } catch (const std::invalid_argument&) {
      throw std::invalid_argument("'" + value + "' is neither true nor false");
    }
    return;
  }
  for (int k = 0;; ++k) {
    const CLI::Validator* validator = nullptr;
    try {
      validator = option.get_validator(k);
    } catch (const CLI::OptionNotFound&) {
      return;  // that was all
    }
    if (const std::string problem = (*validator)(value); !problem.empty())
      throw std::invalid_argument(problem);
  }
}

// Throws std::invalid_argument saying what is wrong with the line.
void check_line(CLI::App& app, const std::string& line) {
  if (line.front() == '[' && line.find('=') == line.npos)
    throw std::invalid_argument("there are no sections, only lines `option = value`");
  const std::size_t equals = line.find('=');
  if (equals == line.npos)
    throw std::invalid_argument("expected `option = value`, there is '" + line + "'");
  const std::string key = trimmed(line.substr(0, equals));
  CLI::Option* const option = app.get_option_no_throw("--" + key);
  if (option == nullptr)
    throw std::invalid_argument("no option is named '" + key + "'; --help lists them");
  try {
    for (const std::string& value : values_of(trimmed(line.substr(equals + 1))))
      check_value(*option, value);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(key + ": " + error.what());
  }
}

}  // namespace

std::string problems_of_options_file(CLI::App& app, const std::filesystem::path& file) {
  if (!std::filesystem::is_regular_file(file)) return file.string() + ": no such file";
  std::ifstream in(file);
  std::string problems;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const std::string text = trimmed(without_comment(line));
    if (text.empty()) continue;
    try {
      check_line(app, text);
    } catch (const std::invalid_argument& error) {
      problems += (problems.empty() ? "" : "\n") + file.string() + " line " +
                  std::to_string(number) + ": " + error.what();
    }
  }
  return problems;
}

}  // namespace km
