#include "host/scene/options.h"
#include <cmath>
#include <doctest/doctest.h>

using namespace wisp;

TEST_CASE("options: counts as people write them, within the same ranges") {
    Options options;
    const std::pair<const char *, const char *> set[] = {
        {"photons", "2.5M"}, {"spp", "1k"},      {"gather", "1e6"},    {"passes", "1k:2.5e5"},
        {"batches", "0:2M"}, {"depth", "6.4e1"}, {"frame-count", "1G"}};
    for (const auto &[name, value] : set) set_option(options, name, value);
    CHECK(options.photons == 2500000);
    CHECK(options.samples == 1000);
    CHECK(options.gather == 1000000);
    CHECK(options.passes->first == 1000);
    CHECK(options.passes->last == 250000);
    CHECK(options.batches->last == 2000000);
    CHECK(options.depth == 64);
    CHECK(*options.frame_count == 1000000000);
    set_option(options, "memory", "1k");
    CHECK(*options.memory == 1024);
    set_option(options, "memory", "2.5M");
    CHECK(*options.memory == 2621440);

    const std::pair<const char *, const char *> wrong[] = {
        {"photons", "1.5"},   {"photons", "1e-3"},   {"photons", "-1k"}, {"photons", "1e19"},
        {"spp", "66k"},       {"gather", "1.0001M"}, {"depth", "1e2"},   {"passes", "0:2.2G"},
        {"passes", "1k:1e3"}, {"size", "1kx1k"},     {"frames", "1k"}};
    for (const auto &[name, value] : wrong) {
        CAPTURE(value);
        CHECK_THROWS_AS(set_option(options, name, value), Error);
    }
}

TEST_CASE("options: names, forms and ranges") {
    Options options;
    const std::pair<const char *, const char *> set[] = {
        {"spp", "9"},       {"exposure", "-1"},         {"quiet", "1"},         {"density-step", "-0"},
        {"reference", "1"}, {"passes", "7:2147483647"}, {"output", "a.passes"}, {"error-out", "e_%04d.pfm"}};
    for (const auto &[name, value] : set) set_option(options, name, value);
    CHECK(options.samples == 9);
    CHECK(options.exposure == -1);
    CHECK(options.quiet);
    CHECK(!std::signbit(*options.density_step));
    CHECK(options.reference);
    CHECK(options.passes->first == 7);
    CHECK(options.passes->last == 2147483647);
    CHECK(options.outputs.back() == "a.passes");
    CHECK(options.error_out == "e_%04d.pfm");

    const struct {
        const char *name, *value, *error;
    } wrong[] = {
        {"spp", "0", "option 'spp': found '0', expected a whole number from 1 to 65536"},
        {"spp", "4.5", "option 'spp': found '4.5', expected a whole number from 1 to 65536"},
        {"photons", "1.5", "option 'photons': found '1.5', expected a whole number from 0 to 9223372036854775807"},
        {"spp", "1M", "option 'spp': found '1M', expected a whole number from 1 to 65536"},
        {"gather", "1", "option 'gather': found '1', expected a whole number from 2 to 1000000"},
        {"size", "20", "option 'size': found '20', expected WIDTHxHEIGHT"},
        {"crop", "5,5,5,6", "option 'crop': found '5,5,5,6', expected X0 < X1 and Y0 < Y1"},
        {"frames", "3:1", "option 'frames': found '3:1', expected A:B, B not below A"},
        {"memory", "12Q", "option 'memory': found '12Q', expected bytes, with k, M or G behind"},
        {"memory", "0.5", "option 'memory': found '0.5', expected bytes, with k, M or G behind"},
        {"memory", "inf", "option 'memory': found 'inf', expected bytes, with k, M or G behind"},
        {"memory", "99999999999G", "option 'memory': found '99999999999G', expected bytes, with k, M or G behind"},
        {"arith", "f16", "option 'arith': found 'f16', expected f32, f64, fixed"},
        {"deposit", "nearest", "option 'deposit': found 'nearest', expected exact, path, kernel, nodes"},
        {"direction", "median", "option 'direction': found 'median', expected flux, mean; did you mean 'mean'?"},
        {"light-step", "0.001", "option 'light-step': found '0.001', expected 0, or a number from 0.01 to 1000"},
        {"irradiance-step", "0", "option 'irradiance-step': found '0', expected a number from 0.01 to 1000"},
        {"output", "a.jpg",
         "option 'output': found 'a.jpg', expected a file name that ends in .png, .pfm, .exr, .passes or .map, or -"},
        {"output", ".passes",
         "option 'output': found '.passes', expected a file name that ends in .png, .pfm, .exr, .passes or .map, or -"},
        {"passes", "3", "option 'passes': found '3', expected A:B"},
        {"passes", "1:2:3", "option 'passes': found '1:2:3', expected A:B"},
        {"passes", "3:3", "option 'passes': found '3:3', expected A:B with A < B"},
        {"passes", "-1:3", "option 'passes': found '-1:3', expected a whole number from 0 to 2147483646"},
        {"passes", "0:2147483648",
         "option 'passes': found '0:2147483648', expected a whole number from 1 to 2147483647"},
        {"passes", "0:", "option 'passes': found '0:', expected a whole number from 1 to 2147483647"},
        {"error-out", "e.png", "option 'error-out': found 'e.png', expected a file name that ends in .pfm"},
        {"error-out", "e.passes", "option 'error-out': found 'e.passes', expected a file name that ends in .pfm"},
        {"step", "nan", "option 'step': found 'nan', expected a number from 0.0001 to 1000"},
        {"step", "0.00009", "option 'step': found '0.00009', expected a number from 0.0001 to 1000"},
        {"reference", "", "option 'reference': found '', expected 1"},
        {"shadows", "soft",
         "option 'shadows': found 'soft', expected trace, cache, paper, exact, voxel, lightbuffer, lie"},
        {"digest", "no", "option 'digest': found 'no', expected 1"},
        {"bogus", "", "there is no option 'bogus'; 'wisp help' lists them"},
    };
    for (const auto &c : wrong) {
        std::string found = "no error";
        try {
            set_option(options, c.name, c.value, "a.aff:3");
        } catch (const Error &error) {
            found = error.what();
            CHECK(error.status == exit_usage);
        }
        CHECK(found == std::string("a.aff:3: ") + c.error);
    }
}
