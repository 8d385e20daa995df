#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "apps/output_file.hpp"

namespace km {

/// Files that a subcommand writes beside its table.
struct ReportFiles {
  std::filesystem::path json, plot;

  /// Defines --json and --plot, with what they have in them.
  void define(CLI::App& app, const std::string& in_json, const std::string& in_plot) {
    app.add_option("--json", json, "Also write " + in_json + " to this file, as JSON");
    app.add_option("--plot", plot, "Also draw " + in_plot + ", as SVG");
  }

  /// As check_output_folder(), before the work.
  void check() const {
    check_output_folder(json);
    check_output_folder(plot);
  }

  /// `write_json(std::ostream&)`; `draw()` makes the text of the SVG.
  void write(const auto& write_json, const auto& draw) const {
    write_output(json, write_json);
    write_output(plot, [&](std::ostream& out) { out << draw(); });
  }
};

}  // namespace km
