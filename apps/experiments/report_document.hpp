#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "modules/charts/plot.hpp"

namespace km {

/// A cell of a table: our value and, if there is one, that of the paper.
struct ReportCell {
  std::string text;
  std::string paper = {};
  enum class Style { kPlain, kBest, kMet, kMissed } style = Style::kPlain;
};

/// Columns under one heading.
struct ColumnGroup {
  std::string title;
  std::size_t columns = 1;
};

struct ReportTable {
  std::string caption;
  std::vector<ColumnGroup> groups = {};  ///< Empty: no second row of headings.
  std::vector<std::string> columns;      ///< Of the first, too: it names the rows.
  std::vector<std::vector<ReportCell>> rows = {};
  std::string note = {};
  bool words = false;  ///< Columns are text, not numbers: to the left.
};

struct ReportParagraph {
  std::string text;
};

/// One picture of a row of them: plots, or a PNG file.
struct ReportFigure {
  std::string name;  ///< figure-NAME is its anchor; of a picture, stem of its file.
  std::string caption;
  std::vector<Plot> plots = {};
  std::filesystem::path png = {};
};

struct ReportFigures {
  std::vector<ReportFigure> figures;
};

/// How the numbers were got; the steps are folded away where that can be.
struct ReportProvenance {
  struct Row {
    std::string what, command, when, machine;
  };
  std::string common;             ///< What all rows have in common: their machine, say.
  std::vector<Row> rows;          ///< What was done.
  std::vector<std::string> open;  ///< What was not, and why.
};

using ReportBlock = std::variant<ReportParagraph, ReportTable, ReportFigures, ReportProvenance>;

struct ReportSection {
  std::string id;  ///< Of its anchor.
  std::string title;
  std::vector<ReportBlock> blocks = {};

  /// Appends a block, unless it is a table without rows.
  void add(ReportBlock block);
};

struct ReportDocument {
  std::string title;
  std::string lead;  ///< What this is, in a sentence or two.
  std::vector<ReportSection> sections;
};

/// One page without references to anything outside: styles, plots and pictures are in it. Throws
/// std::runtime_error for a picture that cannot be read.
[[nodiscard]] std::string to_html(const ReportDocument& document);

/// The same as Markdown; its pictures are figures/NAME.png, its plots those of report.html.
[[nodiscard]] std::string to_markdown(const ReportDocument& document);

}  // namespace km
