#include <fstream>
#include <iostream>
#include <stdexcept>

#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/image_list.hpp"
#include "apps/vocabulary/orb_images.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"
#include "modules/place_recognition/vocabulary_training.hpp"

namespace km {

int train(const TrainCommand& command) {
  const VocabularyTrainingConfig config = checked(VocabularyTrainingConfig{
      .branching = command.branching, .depth = command.depth, .seed = command.seed});
  const auto images = list_images(command.images, command.every);
  const auto descriptors = orb_descriptors(images, command.features);
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
  if (!command.json.empty()) {
    std::ofstream json(command.json);
    json << "{\"words\": " << data.idf.size() << ", \"nodes\": " << data.children.size()
         << ", \"bytes\": " << bytes << ", \"id\": \"" << id << "\", \"descriptors\": " << total
         << ", \"images\": " << images.size() << "}\n";
    if (!json.flush()) throw std::runtime_error(command.json + " cannot be written");
  }
  return 0;
}

}  // namespace km
