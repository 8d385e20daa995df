#pragma once

#include <filesystem>
#include <ostream>
#include <string>

#include "apps/output_file.hpp"
#include "apps/program_options.hpp"
#include "modules/charts/chart_page.hpp"

namespace km {

/// Files that a command writes beside its table.
struct ReportFiles {
  std::filesystem::path json, plot;

  /// Defines --json and --plot, and describes their content. A plot is a page: other file names are
  /// refused.
  void define(CLI::App& app, const std::string& in_json, const std::string& in_plot) {
    app.add_option("--json", json, "Also write " + in_json + " to this file, as JSON");
    app.add_option("--plot", plot, "Also draw " + in_plot + ", as a page for a browser: *.html")
        ->check([](const std::string& file) {
          return file.ends_with(".html") ? std::string()
                                         : file +
                                               ": --plot writes *.html (its charts can be saved "
                                               "as *.svg in the browser)";
        });
  }

  /// Checks the folders of the files, see check_output_folder(); call it before the work.
  void check() const {
    check_output_folder(json);
    check_output_folder(plot);
  }

  /// Writes the files: `write_json(std::ostream&)`; `draw()` makes the plots of the page called
  /// `title`.
  void write(const auto& write_json, const std::string& title, const auto& draw) const {
    write_output(json, write_json);
    write_output(plot, [&](std::ostream& out) { out << chart_page(title, draw()); });
  }
};

}  // namespace km
