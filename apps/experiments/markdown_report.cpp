#include <sstream>

#include "apps/experiments/report_document.hpp"

namespace km {
namespace {

std::string in_cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

std::string cell_text(const ReportCell& cell) {
  const bool strong = cell.style != ReportCell::Style::kPlain && !cell.text.empty();
  const std::string text = strong ? "**" + in_cell(cell.text) + "**" : in_cell(cell.text);
  return cell.paper.empty() ? text : text + " (" + in_cell(cell.paper) + ')';
}

// Markdown has one row of headings: a group's title goes before each of its columns'.
std::vector<std::string> headings(const ReportTable& table) {
  std::vector<std::string> titles;
  std::size_t column = 0;
  for (const ColumnGroup& group : table.groups)
    for (std::size_t k = 0; k < group.columns && column < table.columns.size(); ++k, ++column)
      titles.push_back(group.title.empty() ? table.columns[column]
                                           : group.title + ": " + table.columns[column]);
  return table.groups.empty() ? table.columns : titles;
}

class MarkdownWriter {
 public:
  void operator()(const ReportParagraph& paragraph) { out_ << paragraph.text << "\n\n"; }

  void operator()(const ReportTable& table) {
    out_ << "**" << table.caption << "**\n\n|";
    for (const std::string& title : headings(table)) out_ << ' ' << in_cell(title) << " |";
    out_ << "\n|";
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      out_ << (c == 0 || table.words ? " --- |" : " ---: |");
    out_ << '\n';
    for (const auto& row : table.rows) {
      out_ << '|';
      for (const ReportCell& cell : row) out_ << ' ' << cell_text(cell) << " |";
      out_ << '\n';
    }
    out_ << '\n';
    if (!table.note.empty()) out_ << table.note << "\n\n";
  }

  void operator()(const ReportFigures& row) {
    for (const ReportFigure& figure : row.figures)
      out_ << "![" << figure.caption << "](figures/" << figure.name
           << (figure.svg.empty() ? ".png" : ".svg") << ")\n\n";
  }

  void operator()(const ReportProvenance& provenance) {
    if (!provenance.common.empty()) out_ << provenance.common << "\n\n";
    for (const std::string& line : provenance.open) out_ << line << "\n\n";
    if (provenance.rows.empty()) return;
    out_ << "<details><summary>" << provenance.rows.size() << " steps</summary>\n\n";
    for (const auto& row : provenance.rows)
      out_ << "- " << row.what << ": `" << row.command << "`; " << row.when
           << (row.machine.empty() ? "" : "; ") << row.machine << '\n';
    out_ << "\n</details>\n\n";
  }

  void write(const ReportSection& section) {
    out_ << "## " << section.title << "\n\n";
    for (const ReportBlock& block : section.blocks) std::visit(*this, block);
  }

  std::string text() const { return out_.str(); }

 private:
  std::ostringstream out_;
};

}  // namespace

std::string to_markdown(const ReportDocument& document) {
  MarkdownWriter writer;
  for (const ReportSection& section : document.sections) writer.write(section);
  return "# " + document.title + "\n\n" + document.lead + "\n\n" + writer.text();
}

}  // namespace km
