#include "client/cli/job_chart.h"

#include "client/cli/units.h"

namespace lightmill::cli {

Chart job_chart(const v1::Job& job) {
  Chart chart;
  chart.title = fmt::format("job {}: {}", job.id(), job.name());
  chart.x_label = "thread seconds";
  chart.y_label = "estimated relMSE";
  ChartSeries series{fmt::format("{}, {}x{}, seed {}", job.method(), job.width(), job.height(), job.seed()), {}};
  for (const v1::ErrorPoint& point : job.history()) {
    const double error = point.error().rel_mse(), half_width = point.error().half_width();
    series.points.push_back({point.worker_seconds(), error, error - half_width, error + half_width,
                             fmt::format("{:.6g} samples per pixel, {} of threads, {:.3g} ± {:.2g}", point.samples(),
                                         human_seconds(point.worker_seconds()), error, half_width)});
  }
  chart.series.push_back(std::move(series));
  chart.guides = {{-1, "slope −1"}};
  if (job.goal().error() > 0) {
    chart.levels = {{job.goal().error(), "goal"}};
  }
  return chart;
}

}  // namespace lightmill::cli
