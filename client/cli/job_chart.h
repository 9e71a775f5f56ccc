// A job's own error against time.
#pragma once

#include "client/chart/chart.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// From the job's history: the error that it states of itself, with its interval.
Chart job_chart(const v1::Job& job);

}  // namespace lightmill::cli
