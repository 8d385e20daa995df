#include "modules/place_recognition/bag_file.hpp"

#include <charconv>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string_view>

namespace km {
namespace {

// A number at the start of `text`, which is removed from it.
std::optional<std::uint32_t> take_number(std::string_view& text) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{}) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return number;
}

bool take(char expected, std::string_view& text) {
  if (text.empty() || text.front() != expected) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<BagOfWords> bag_of_line(std::string_view line) {
  BagOfWords bag;
  while (!line.empty()) {
    if (!bag.empty() && !take(' ', line)) return std::nullopt;
    const auto word = take_number(line);
    if (!word || !take(':', line)) return std::nullopt;
    const auto count = take_number(line);
    if (!count || *count == 0 || (!bag.empty() && bag.back().word >= *word)) return std::nullopt;
    bag.push_back({*word, *count});
  }
  return bag;
}

}  // namespace

std::string bags_text(const std::vector<BagOfWords>& bags) {
  std::string text;
  for (const BagOfWords& bag : bags) {
    for (std::size_t i = 0; i < bag.size(); ++i) {
      if (i > 0) text += ' ';
      text += std::to_string(bag[i].word);
      text += ':';
      text += std::to_string(bag[i].count);
    }
    text += '\n';
  }
  return text;
}

std::vector<BagOfWords> read_bags(const std::filesystem::path& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  std::vector<BagOfWords> bags;
  for (std::string line; std::getline(in, line);) {
    std::optional<BagOfWords> bag = bag_of_line(line);
    if (!bag)
      throw std::runtime_error(file.string() + ", line " + std::to_string(bags.size() + 1) +
                               ": no bag of words: \"word:count ...\" with ascending words");
    bags.push_back(*std::move(bag));
  }
  return bags;
}

}  // namespace km
