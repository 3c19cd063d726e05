// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "calib/discover/discover_table.h"

/// How a page about a table says things.
namespace toftwin::discover {

std::string joined(const std::vector<std::string>& names, const char* between = " and ");
/// What has an offset of its own: "session", or "capture".
const char* partOf(const TableDiscovery& discovery);
/// " mm", or nothing.
std::string unitOf(const TableDiscovery& discovery);
/// "error [mm]"
std::string labelled(const TableDiscovery& discovery, const char* what);
/// Digits so that a typical deviation has two, and three where it is far below one, as millimetres in metres are.
int decimalsOf(const TableDiscovery& discovery);
std::string significant(double value);
/// A value of a covariate as its column has it: of a time the date.
std::string placeInWords(const TableDiscovery& discovery, const std::string& covariate, double x);
bool isCertain(const Effect& effect);
/// "it goes with time_s (exponential in time_s), by up to 3.1 mm between rows, or with …"
std::string nameInWords(const TableDiscovery& discovery, const Effect& effect);
/// Whether most of what rows err by goes slowly from one to the next.
bool wanders(const TableDiscovery& discovery);
/// Covariates in whose order they stand then, other than time.
std::vector<std::string> wanderAlong(const TableDiscovery& discovery);
/// That such a wander and a curve over those, or something that no column tells, are not to be told apart; empty where rows
/// do not wander.
std::string wanderInWords(const TableDiscovery& discovery);
/// That a curve over the reference contains the gain; empty where none does.
std::string containedInWords(const TableDiscovery& discovery);
/// Captures, or rows, that err alike and far from the others.
std::string oddInWords(const TableDiscovery& discovery);
/// Null: the table has no such covariate.
const std::vector<double>* valuesOf(const TableData& data, const std::string& name);

}  // namespace toftwin::discover
