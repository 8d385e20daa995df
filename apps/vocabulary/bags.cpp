#include <iostream>
#include <memory>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/place_recognition/bag_file.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {
namespace {

struct BagsCommand : VocabularyCommand {
  std::vector<std::string> images;
  std::string output;
};

void define(Command app, BagsCommand& command) {
  app.add_option("vocabulary", command.vocabulary, "Vocabulary file").required();
  app.add_option("images", command.images, "IMAGES, in the order of the bags").required();
  app.add_option("-o,--output", command.output, "File of the bags, one line per image").required();
  command.define_images(app);
}

void run(const BagsCommand& command) {
  check_output_folder(command.output);
  const Vocabulary vocabulary = load_vocabulary(command.vocabulary);
  std::vector<BagOfWords> bags;
  for (const auto& descriptors :
       image_descriptors(list_images(command.images, command.every), command.features))
    bags.push_back(vocabulary.count(descriptors));
  write_output(command.output, [&](std::ostream& out) { out << bags_text(bags); });
  std::cout << bags.size() << " bags\n";
}

}  // namespace

void add_bags(Command parent) {
  const Command app =
      parent.add_subcommand("bags", "Write the words of images to a file, for kimera_multi_crowd");
  const auto command = std::make_shared<BagsCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
