#pragma once

#include <string>

#include "apps/command_line.hpp"

namespace km {

/// Options that all commands share.
struct VocabularyCommand {
  std::string vocabulary;  ///< The file to write or to read.
  std::string json;        ///< Results for programs; none if empty.
  int features = 1000;     ///< ORB features per image.
  int every = 1;           ///< Use every n-th image.

  void define(Command app) {
    define_images(app);
    app.add_option("--json", json, "Also write the results to this file, as JSON");
  }
  /// Without --json.
  void define_images(Command app) {
    app.add_option("--features", features, "ORB features per image")
        .within(1, 100000)
        .show_default();
    app.add_option("--every", every, "Use every N-th image of an input")
        .within(1, 1000000)
        .show_default();
  }
};

/// Add a subcommand to `app`, which runs as soon as the command line names it and prints to stdout.
/// Unusable input throws a std::exception.
void add_train(Command app);
void add_inspect(Command app);
void add_evaluate(Command app);
void add_describe(Command app);
void add_patches(Command app);

}  // namespace km
