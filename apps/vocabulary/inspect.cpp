#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {
namespace {

struct InspectCommand : VocabularyCommand {
  std::vector<std::string> pair;  ///< Two images to compare, or none.
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

void define(CLI::App& app, InspectCommand& command) {
  app.add_option("vocabulary", command.vocabulary, "Vocabulary file")->required();
  app.add_option("--pair", command.pair, "Two images to compare")->expected(2);
  command.VocabularyCommand::define(app);
}

void run(const InspectCommand& command) {
  check_output_folder(command.json);
  const Vocabulary vocabulary = load_vocabulary(command.vocabulary);
  print(vocabulary, command.vocabulary);
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
