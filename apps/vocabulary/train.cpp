#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"

namespace km {
namespace {

struct TrainCommand : VocabularyCommand {
  std::vector<std::string> images;
  int branching = 10;
  int depth = 5;
  std::uint32_t seed = 1;
  int every = 1;
};

void define(CLI::App& app, TrainCommand& command) {
  app.add_option("images", command.images, "IMAGES to learn from, as varied as the places to come")
      ->required();
  app.add_option("-o,--output", command.vocabulary, "Vocabulary file to write")->required();
  app.add_option("-k,--branching", command.branching, "Children of a node of the tree")
      ->capture_default_str();
  app.add_option("-L,--depth", command.depth,
                 "Levels of the tree: at most k^L words, about 37 bytes each")
      ->capture_default_str();
  app.add_option("--seed", command.seed, "Seed of the random start of clustering")
      ->capture_default_str();
  app.add_option("--every", command.every, "Use every N-th image of an input")
      ->check(CLI::Range(1, 1000000))
      ->capture_default_str();
  command.VocabularyCommand::define(app);
}

void run(const TrainCommand& command) {
  check_output_folder(command.vocabulary);
  check_output_folder(command.json);
  const VocabularyTrainingConfig config = checked(VocabularyTrainingConfig{
      .branching = command.branching, .depth = command.depth, .seed = command.seed});
  const auto images = list_images(command.images, command.every);
  const auto descriptors = image_descriptors(images, command.features);
  const VocabularyData data = train_vocabulary(descriptors, config, [&](int levels) {
    std::cerr << "training: level " << levels << " of " << config.depth << '\n';
  });
  save_vocabulary(data, command.vocabulary);

  std::size_t total = 0;
  for (const auto& image : descriptors) total += image.size();
  const std::string id = fingerprint_text(fingerprint(data));
  const auto bytes = std::filesystem::file_size(command.vocabulary);
  std::cout << command.vocabulary << ": " << data.idf.size() << " words, " << data.children.size()
            << " nodes, " << bytes << " bytes, id " << id << "\nfrom " << total
            << " descriptors of " << images.size() << " images\n";
  write_output(command.json, [&](std::ostream& out) {
    out << nlohmann::ordered_json{{"words", data.idf.size()}, {"nodes", data.children.size()},
                                  {"bytes", bytes},           {"id", id},
                                  {"descriptors", total},     {"images", images.size()}}
        << '\n';
  });
}

}  // namespace

void add_train(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("train", "Learn a vocabulary from images");
  const auto command = std::make_shared<TrainCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
