#include <algorithm>
#include <bit>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {
namespace {

struct InspectCommand : VocabularyCommand {
  std::vector<std::string> images;  ///< Images whose words are counted.
  std::vector<std::string> pair;    ///< Two images to compare, or none.
};

// Number of leaves at each depth.
std::vector<std::size_t> leaves_by_depth(const VocabularyData& data) {
  std::vector<std::size_t> leaves(1, 0);
  std::size_t level_end = 1;
  std::size_t next = 1;
  for (std::size_t i = 0; i < data.children.size(); ++i) {
    if (i == level_end) {
      leaves.push_back(0);
      level_end = next;
    }
    next += data.children[i];
    if (data.children[i] == 0) ++leaves.back();
  }
  return leaves;
}

struct Usage {
  std::size_t images = 0;
  std::size_t descriptors = 0;
  double words_per_image = 0.0;         // words with a weight above 0
  std::vector<std::size_t> popularity;  // [0] words never seen, [b] 2^(b-1) to 2^b - 1 times
  double effective_words =
      0.0;  // exp of the entropy: number of equally used words with the same information
};

Usage usage_of(const Vocabulary& vocabulary,
               const std::vector<std::vector<BinaryDescriptor>>& descriptors) {
  Usage usage{.images = descriptors.size(), .popularity = std::vector<std::size_t>(1, 0)};
  std::vector<std::size_t> seen(vocabulary.size(), 0);
  for (const auto& image : descriptors) {
    const BagOfWords bag = vocabulary.count(image);
    for (const auto& [word, count] : bag) seen[word] += count;
    usage.words_per_image += static_cast<double>(vocabulary.weigh(bag).words.size());
    usage.descriptors += image.size();
  }
  usage.words_per_image /= static_cast<double>(std::max<std::size_t>(1, usage.images));
  double entropy = 0.0;
  for (const std::size_t count : seen) {
    const auto bin = static_cast<std::size_t>(std::bit_width(count));
    if (usage.popularity.size() <= bin) usage.popularity.resize(bin + 1, 0);
    ++usage.popularity[bin];
    const double p = static_cast<double>(count) / static_cast<double>(usage.descriptors);
    if (count > 0) entropy -= p * std::log(p);
  }
  usage.effective_words = std::exp(entropy);
  return usage;
}

void print(const Vocabulary& vocabulary, const std::string& file) {
  const VocabularyData& data = vocabulary.data();
  std::vector<float> idf = data.idf;
  std::sort(idf.begin(), idf.end());
  const auto weightless = std::count(idf.begin(), idf.end(), 0.0F);
  std::cout << file << "\n  id          " << fingerprint_text(vocabulary.id())
            << "\n  shape       k " << data.branching << ", L " << data.depth << ", "
            << data.children.size() << " nodes, " << vocabulary.size() << " words\n  file        "
            << std::filesystem::file_size(file) << " bytes, checksum and tree are sound"
            << "\n  idf         min " << idf.front() << ", median " << idf[idf.size() / 2]
            << ", max " << idf.back() << "; words without weight: " << weightless
            << "\n  leaves      ";
  const std::vector<std::size_t> leaves = leaves_by_depth(data);
  for (std::size_t depth = 1; depth < leaves.size(); ++depth)
    std::cout << (depth > 1 ? ", " : "") << leaves[depth] << " at depth " << depth;
  std::cout << '\n';
}

void print(const Usage& usage) {
  std::cout << "In " << usage.descriptors << " descriptors of " << usage.images << " images\n"
            << "  words of weight per image  " << usage.words_per_image
            << "\n  effective words            " << usage.effective_words
            << "\n  a word is seen             words\n";
  for (std::size_t bin = 0; bin < usage.popularity.size(); ++bin) {
    const std::size_t low = bin == 0 ? 0 : std::size_t{1} << (bin - 1);
    const std::size_t high = bin == 0 ? 0 : (std::size_t{1} << bin) - 1;
    std::cout << std::setw(12) << low << " to" << std::setw(8) << high << std::setw(12)
              << usage.popularity[bin] << '\n';
  }
}

void define(CLI::App& app, InspectCommand& command) {
  app.add_option("vocabulary", command.vocabulary, "Vocabulary file")->required();
  app.add_option("--images", command.images, "IMAGES to count words in");
  app.add_option("--pair", command.pair, "Two images to compare")->expected(2);
  command.VocabularyCommand::define(app);
}

void run(const InspectCommand& command) {
  check_output_folder(command.json);
  const Vocabulary vocabulary = load_vocabulary(command.vocabulary);
  print(vocabulary, command.vocabulary);
  Usage usage;
  if (!command.images.empty()) {
    const auto images = list_images(command.images, command.every);
    usage = usage_of(vocabulary, image_descriptors(images, command.features));
    print(usage);
  }
  double pair_score = std::nan("");
  if (command.pair.size() == 2) {
    const BowVector v = vocabulary.transform(image_descriptors(command.pair[0], command.features));
    const BowVector w = vocabulary.transform(image_descriptors(command.pair[1], command.features));
    pair_score = score(v, w);
    std::cout << "Score of the pair: " << pair_score << " (1: same words, 0: none in common; "
              << v.words.size() << " and " << w.words.size() << " words)\n";
  }
  write_output(command.json, [&](std::ostream& out) {
    out << nlohmann::ordered_json{{"id", fingerprint_text(vocabulary.id())},
                                  {"branching", vocabulary.data().branching},
                                  {"depth", vocabulary.data().depth},
                                  {"words", vocabulary.size()},
                                  {"images", usage.images},
                                  {"words_per_image", usage.words_per_image},
                                  {"effective_words", usage.effective_words},
                                  {"pair_score", pair_score}}  // null if there is none
        << '\n';
  });
}

}  // namespace

void add_inspect(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("inspect", "Check a vocabulary and show what is in it");
  const auto command = std::make_shared<InspectCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
