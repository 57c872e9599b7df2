// Published values of light transport (transport.csv, see README.md here), and how measured values are compared with
// them.
#pragma once
#include "support/built.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <fstream>
#include <string>
#include <vector>

namespace wisp {

struct Row {
    std::string id;
    double value;
};

// The rows `id,quantity,parameters,value,...` of the table, its head included, in the file's order: tests seed each
// row's samples with the row's place. A field may be quoted.
inline std::vector<Row> transport_rows() {
    std::vector<Row> rows;
    std::ifstream file("test/physics/transport.csv");
    for (std::string line; std::getline(file, line);) {
        std::vector<std::string> fields(1);
        bool quoted = false;
        for (char c : line)
            if (c == '"')
                quoted = !quoted;
            else if (c == ',' && !quoted)
                fields.emplace_back();
            else
                fields.back() += c;
        REQUIRE(fields.size() > 3);
        rows.push_back({fields[0], std::atof(fields[3].c_str())});
    }
    REQUIRE(rows.size() == 308);
    return rows;
}

// Whether hardly any light reaches what a row is about: it is that of a few samples in a million.
inline bool too_dark(const Row &row) { return row.id.find("slab_") != std::string::npos && row.value < 1e-6; }

// The mean of some samples, the standard error of that mean, and the skewness of the samples.
struct Score {
    double mean, error, skewness;
    int64_t samples;
};
template <class Sample> Score score(int64_t samples, Sample sample, int64_t first = 0) {
    double sum = 0, square = 0, cube = 0;
    for (int64_t i = first; i < first + samples; ++i) {
        const double x = sample(i);
        sum += x;
        square += x * x;
        cube += x * x * x;
    }
    const double n = static_cast<double>(samples), mean = sum / n, variance = std::max(square / n - mean * mean, 0.0),
                 third = cube / n - mean * (3 * variance + mean * mean);
    return {mean, std::sqrt(variance / n), variance > 0 ? third / (variance * std::sqrt(variance)) : 0, samples};
}

// Samples sample(0), sample(1), ... until the standard error is that part of the mean which the variable WISP_ROW_ERROR
// says, or 5 %. The first samples tell how many are needed, and do not count. False: too many.
template <class Sample> bool score_until(double most_variance, Sample sample, Score &result) {
    const char *wanted = std::getenv("WISP_ROW_ERROR");
    const double error = wanted ? std::atof(wanted) : 0.05;
    constexpr int64_t first = 1000;
    const Score pilot = score(first, sample);
    const double variance = pilot.error * pilot.error * first / (pilot.mean * pilot.mean);
    if (!(variance < most_variance)) return false;
    result = score(std::max(first, static_cast<int64_t>(variance / (error * error))), sample, first);
    return true;
}

// Checks each measured row, then the chi-square of all of them, and writes them to transport_NAME.csv beside the test
// program.
class TransportTable {
  public:
    explicit TransportTable(const std::string &name) : name_(built("transport_" + name + ".csv")) {}
    // The deviation in standard errors is Johnson's, as the samples are skewed: Modified t tests and confidence
    // intervals for asymmetrical populations, 1978, equation 2.5.
    void add(const std::string &id, double value, const Score &score) {
        const double t = (score.mean - value) / score.error, root = std::sqrt(static_cast<double>(score.samples)),
                     deviation = t + score.skewness / root * (1 + 2 * t * t) / 6;
        CAPTURE(id);
        CAPTURE(value);
        CAPTURE(score.mean);
        CHECK(std::fabs(deviation) < 4.5);
        chi_square_ += deviation * deviation;
        ++rows_;
        char line[300];
        std::snprintf(line, sizeof line, "\"%s\",%.8g,%.6g,%.2g,%+.2f,%lld\n", id.c_str(), value, score.mean,
                      score.error, deviation, static_cast<long long>(score.samples));
        text_ += line;
    }
    // A chi-square of n rows has mean n and standard deviation sqrt(2 n). A value that is too small is an error, too.
    void finish(int expected_rows) {
        MESSAGE(name_, ": chi-square ", chi_square_, " of ", rows_, " rows");
        CHECK(rows_ >= expected_rows);
        CHECK(std::fabs(chi_square_ - rows_) < 4 * std::sqrt(2.0 * rows_));
        std::ofstream(name_) << "row,value,measured,standard error,deviation in standard errors,samples\n" << text_;
    }

  private:
    std::string name_, text_;
    double chi_square_ = 0;
    int rows_ = 0;
};

} // namespace wisp
