// A chart of a job's own error estimate against time.
#pragma once

#include "client/chart/chart.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// Made from the job's history. Each point is an estimate with its confidence interval.
Chart job_chart(const v1::Job& job);

}  // namespace lightmill::cli
