#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>

#include "apps/vocabulary/commands.hpp"

namespace {

constexpr const char* kAbout =
    "Vocabularies of visual words: what place recognition compares images by.\n"
    "All robots of a team need the same vocabulary file.\n\n"
    "IMAGES are image files, folders of .png or .jpg, EuRoC/ASL folders (their left camera), or\n"
    "text files that list one image per line. Examples:\n"
    "  kimera_multi_vocabulary train -o site.kmvoc -k 10 -L 4 recording_1 recording_2\n"
    "  kimera_multi_vocabulary inspect site.kmvoc --images recording_1 --pair a.png b.png\n"
    "  kimera_multi_vocabulary evaluate site.kmvoc --known robot_1 --queries robot_2 \\\n"
    "      --truth state_groundtruth_estimate0/data.csv";

void add_shared(CLI::App& app, km::VocabularyCommand& command) {
  app.add_option("--features", command.features, "ORB features per image")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--every", command.every, "Use every N-th image of an input")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the results to this file, as JSON");
}

void add_vocabulary(CLI::App& app, km::VocabularyCommand& command) {
  app.add_option("vocabulary", command.vocabulary, "Vocabulary file")->required();
}

void define(CLI::App& app, km::TrainCommand& command) {
  app.add_option("images", command.images, "IMAGES to learn from, as varied as the places to come")
      ->required();
  app.add_option("-o,--output", command.vocabulary, "Vocabulary file to write")->required();
  app.add_option("-k,--branching", command.branching, "Children of a node of the tree")
      ->capture_default_str();
  app.add_option("-L,--depth", command.depth,
                 "Levels of the tree: at most k^L words, about 37 bytes each")
      ->capture_default_str();
  app.add_option("--seed", command.seed, "Of the random start of clustering")
      ->capture_default_str();
  add_shared(app, command);
}

void define(CLI::App& app, km::InspectCommand& command) {
  add_vocabulary(app, command);
  app.add_option("--images", command.images, "IMAGES to count words in");
  app.add_option("--pair", command.pair, "Two images to compare")->expected(2);
  add_shared(app, command);
}

void define(CLI::App& app, km::EvaluateCommand& command) {
  add_vocabulary(app, command);
  app.add_option("--known", command.known, "IMAGES a robot has taken, named by stamp [ns]")
      ->required();
  app.add_option("--queries", command.queries, "IMAGES another robot sends, named by stamp [ns]")
      ->required();
  app.add_option("--truth", command.truth, "Poses of both: TUM text, or EuRoC .csv")->required();
  app.add_option("--max-distance", command.max_distance_m,
                 "Two images show the same place up to this distance [m] ...")
      ->capture_default_str();
  app.add_option("--max-angle", command.max_angle_deg, "... and this angle between them [deg]")
      ->capture_default_str();
  app.add_option("--min-normalizer", command.min_normalizer,
                 "Least score of a query against the image before it")
      ->capture_default_str();
  app.add_option("--max-candidates", command.max_candidates,
                 "Only so many candidates per query, the best ones (default: all)");
  add_shared(app, command);
}

}  // namespace

int main(int argc, char** argv) try {
  CLI::App app(kAbout);
  app.require_subcommand(1);
  km::TrainCommand training;
  km::InspectCommand inspection;
  km::EvaluateCommand evaluation;
  auto* train = app.add_subcommand("train", "Learn a vocabulary from images");
  auto* inspect = app.add_subcommand("inspect", "Check a vocabulary and show what is in it");
  auto* evaluate = app.add_subcommand(
      "evaluate", "Precision and recall of candidates over the similarity threshold");
  define(*train, training);
  define(*inspect, inspection);
  define(*evaluate, evaluation);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 1;
  }
  if (train->parsed()) return km::train(training);
  if (inspect->parsed()) return km::inspect(inspection);
  return km::evaluate(evaluation);
} catch (const std::exception& error) {
  std::cerr << "kimera_multi_vocabulary: " << error.what() << '\n';
  return 1;
}
