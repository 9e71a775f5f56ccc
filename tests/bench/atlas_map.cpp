// The failure atlas as a map: every case by every method, measured and judged, as one HTML page, CSV and JSON.
#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <thread>

#include "tests/atlas/map/atlas_page.h"
#include "tests/atlas/map/measured_rows.h"

namespace {

using namespace lightmill::test;

std::atomic<bool> interrupted = false;

void interrupt(int) {
  interrupted = true;
}

std::vector<AtlasCase> cases_with(const std::string& text) {
  std::vector<AtlasCase> chosen;
  for (const AtlasGroup& group : atlas_groups()) {
    for (AtlasCase& each : group.cases()) {
      if ((each.subject + ": " + each.name).find(text) != std::string::npos) {
        chosen.push_back(std::move(each));
      }
    }
  }
  return chosen;
}

void print(const AtlasRow& row, std::size_t done, std::size_t all, bool kept) {
  std::printf("%zu/%zu %s: %s%s\n", done, all, row.what.subject.c_str(), row.what.name.c_str(),
              kept ? " (measured before)" : "");
  for (const AtlasCell& cell : row.cells) {
    std::printf("  %-8s %-7s", cell.method.c_str(), name_of(cell.outcome));
    if (cell.measured) {
      std::printf(" %+9.3f %%  z %8.1f  %8.2g s to 1 %%", 100 * (cell.energy - 1), cell.z, cell.seconds_to_percent);
    }
    std::printf("%s%s\n", cell.reason.empty() ? "" : "  ", cell.reason.c_str());
  }
  std::fflush(stdout);
}

/// Measures the cases on several threads, and returns rows in the order of the cases. Interrupted cases are left out.
std::vector<AtlasRow> measure_all(const std::vector<AtlasCase>& cases, const AtlasSettings& settings,
                                  const MeasuredRows& measured, int threads) {
  std::vector<AtlasRow> rows(cases.size());
  std::vector<char> complete(cases.size(), 0);
  std::atomic<std::size_t> next = 0, done = 0;
  std::mutex printing;
  const auto work = [&] {
    for (std::size_t i = next++; i < cases.size() && !interrupted; i = next++) {
      std::optional<AtlasRow> kept = measured.find(cases[i], settings);
      AtlasRow row = kept ? *kept : measure(cases[i], settings);
      if (!kept && interrupted) {
        return;
      }
      const std::lock_guard lock(printing);
      if (const auto status = kept ? lightmill::Status() : measured.keep(row, settings); !status.ok()) {
        std::fprintf(stderr, "atlas_map: %s\n", lightmill::message_of(status).c_str());
      }
      print(row, ++done, cases.size(), kept.has_value());
      rows[i] = std::move(row);
      complete[i] = 1;
    }
  };
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < threads; ++i) {
      others.emplace_back(work);
    }
    work();
  }
  std::vector<AtlasRow> out;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (complete[i] != 0) {
      out.push_back(std::move(rows[i]));
    }
  }
  return out;
}

bool write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  if (!file) {
    std::fprintf(stderr, "atlas_map: cannot write %s\n", path.c_str());
  }
  return static_cast<bool>(file);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Measures and judges every case of the failure atlas by every method. With --retries 1 it takes half an "
      "hour of one core. Writes index.html, atlas.csv and atlas.json, and a file in DIR/rows for each case. After an "
      "interruption the same command resumes. Exit code 1 if a method is wrong without a veto.");
  AtlasSettings settings;
  settings.methods = atlas_methods();
  settings.retries = 2;
  settings.stop = &interrupted;
  std::string only;
  std::filesystem::path folder;
  int threads = 2;
  bool vetoed_too = true;
  app.add_option("-o,--out", folder, "DIR, the folder for the page and the numbers; created if missing")->required();
  app.add_option("--methods", settings.methods, "methods to measure")->capture_default_str()->delimiter(',');
  app.add_option("--levels", settings.more_levels, "log2 of the factor of samples")
      ->capture_default_str()
      ->check(CLI::Range(-8, 8));
  app.add_option("--retries", settings.retries, "repeats with 16 times the samples if a result looks wrong")
      ->capture_default_str()
      ->check(CLI::Range(0, 3));
  app.add_option("--only", only, "cases whose subject and name have this text");
  app.add_option("--threads", threads, "cases at a time")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_flag("!--admitted-only", vetoed_too, "skip methods that the planner vetoes");
  CLI11_PARSE(app, argc, argv);
  settings.measure_vetoed = vetoed_too;

  std::error_code error;
  std::filesystem::create_directories(folder / "rows", error);
  if (error) {
    std::fprintf(stderr, "atlas_map: cannot create %s: %s\n", folder.c_str(), error.message().c_str());
    return 2;
  }
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  const std::vector<AtlasCase> cases = cases_with(only);
  const std::vector<AtlasRow> rows = measure_all(cases, settings, MeasuredRows(folder / "rows"), threads);
  if (interrupted) {
    std::fprintf(stderr, "atlas_map: interrupted after %zu of %zu cases; run the same command to resume\n", rows.size(),
                 cases.size());
    return 130;
  }
  int wrong = 0;
  for (const std::string& method : settings.methods) {
    const OutcomeCounts n = count_outcomes(rows, method);
    std::printf("%-8s %3d right, %d slow, %d alone, %d vetoed, %d wrong\n", method.c_str(), n.right, n.slow, n.alone,
                n.vetoed, n.wrong);
    wrong += n.wrong;
  }
  std::printf("wrong without a veto: %d\n", wrong);
  if (!write(folder / "index.html", atlas_html(rows, settings)) || !write(folder / "atlas.csv", atlas_csv(rows)) ||
      !write(folder / "atlas.json", atlas_json(rows, settings))) {
    return 2;
  }
  return wrong > 0 ? 1 : 0;
}
