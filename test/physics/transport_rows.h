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
    REQUIRE(rows.size() == 204);
    return rows;
}

// The mean of sample(0), ..., sample(samples - 1), and the standard error of that mean.
struct Score {
    double mean, error;
};
template <class Sample> Score score(int samples, Sample sample) {
    double sum = 0, square = 0;
    for (int i = 0; i < samples; ++i) {
        const double x = sample(i);
        sum += x;
        square += x * x;
    }
    const double mean = sum / samples;
    return {mean, std::sqrt(std::max(square / samples - mean * mean, 0.0) / samples)};
}

// Checks each measured row, then the chi-square of all of them, and writes them to transport_NAME.csv beside the test
// program.
class TransportTable {
  public:
    explicit TransportTable(const std::string &name) : name_(built("transport_" + name + ".csv")) {}
    void add(const std::string &id, double value, const Score &score) {
        const double deviation = (score.mean - value) / score.error;
        CAPTURE(id);
        CAPTURE(value);
        CAPTURE(score.mean);
        CHECK(std::fabs(deviation) < 4.5);
        chi_square_ += deviation * deviation;
        ++rows_;
        char line[300];
        std::snprintf(line, sizeof line, "\"%s\",%.8g,%.6g,%.2g,%+.2f\n", id.c_str(), value, score.mean, score.error,
                      deviation);
        text_ += line;
    }
    // A chi-square of n rows has mean n and standard deviation sqrt(2 n). A value that is too small is an error, too.
    void finish(int expected_rows) {
        MESSAGE(name_, ": chi-square ", chi_square_, " of ", rows_, " rows");
        CHECK(rows_ >= expected_rows);
        CHECK(std::fabs(chi_square_ - rows_) < 4 * std::sqrt(2.0 * rows_));
        std::ofstream(name_) << "row,reference,measured,standard error,deviation in standard errors\n" << text_;
    }

  private:
    std::string name_, text_;
    double chi_square_ = 0;
    int rows_ = 0;
};

} // namespace wisp
