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
  std::vector<std::string>
      columns;  ///< Headings, including that of the first column, which names the rows.
  std::vector<std::vector<ReportCell>> rows = {};
  std::string note = {};
  bool words = false;  ///< Columns are text, aligned to the left.
};

struct ReportParagraph {
  std::string text;
};

/// One picture of a row of them: plots, or a PNG file.
struct ReportFigure {
  std::string name;  ///< figure-NAME is its anchor; for a PNG file, the stem of the file.
  std::string caption;
  std::vector<Plot> plots = {};
  std::filesystem::path png = {};
};

struct ReportFigures {
  std::vector<ReportFigure> figures;
};

/// Origin of the numbers; in HTML the steps are collapsed.
struct ReportProvenance {
  struct Row {
    std::string what, command, when, machine;
  };
  std::string common;             ///< Properties common to all rows, for instance the machine.
  std::vector<Row> rows;          ///< Steps that were done.
  std::vector<std::string> open;  ///< Steps that were not done, with the reason.
};

using ReportBlock = std::variant<ReportParagraph, ReportTable, ReportFigures, ReportProvenance>;

struct ReportSection {
  std::string id;  ///< Id of its anchor.
  std::string title;
  std::vector<ReportBlock> blocks = {};

  /// Appends a block, unless it is a table without rows.
  void add(ReportBlock block);
};

struct ReportDocument {
  std::string title;
  std::string lead;  ///< Description in one or two sentences.
  std::vector<ReportSection> sections;
};

/// One page without external references: styles, plots and pictures are embedded. Throws
/// std::runtime_error for an unreadable picture.
[[nodiscard]] std::string to_html(const ReportDocument& document);

/// The document as Markdown; its pictures are figures/NAME.png, its plots those of report.html.
[[nodiscard]] std::string to_markdown(const ReportDocument& document);

}  // namespace km
