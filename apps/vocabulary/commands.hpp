#pragma once

#include <string>

#include "apps/program_options.hpp"

namespace km {

/// Options that all commands share.
struct VocabularyCommand {
  std::string vocabulary;  ///< The file to write or to read.
  std::string json;        ///< Results for programs; none if empty.
  int features = 1000;     ///< ORB features per image.

  void define(CLI::App& app) {
    app.add_option("--features", features, "ORB features per image")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    app.add_option("--json", json, "Also write the results to this file, as JSON");
  }
};

/// Add a subcommand to `app`, which runs as soon as the command line names it and prints to stdout.
/// Unusable input throws a std::exception.
void add_train(CLI::App& app);
void add_inspect(CLI::App& app);

}  // namespace km
