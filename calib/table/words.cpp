// SPDX-License-Identifier: Apache-2.0
#include "calib/table/words.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>

#include "calib/table/number.h"

namespace toftwin::table {
namespace {

/// Words of one meaning and strength, small, without accents.
struct WordRow {
  Meaning meaning;
  int strength;
  std::string_view words;
};

using enum Meaning;

constexpr std::array kWords{
    WordRow{
        Measured, 3,
        "measured measurement meas gemessen messwert messwerte messung istwert mesure mesuree mesures medido "
        "medida medicion misurato misurata misura misurazione"},
    WordRow{
        Measured, 2,
        "value reading readout output observed ist anzeige valeur lecture lu valor lectura observado valore "
        "lettura osservato"},
    WordRow{Measured, 1, "actual camera sensor tof"},
    WordRow{Range, 3,
            "depth range tiefe reichweite profondeur portee profundidad alcance rango profondita portata"},
    WordRow{Range, 2, "distance dist z d abstand entfernung distanz distancia distanza eloignement"},
    WordRow{
        Reference, 3,
        "reference ref truth groundtruth gt referenz soll sollwert sollabstand referencia riferimento verite "
        "verdad verita"},
    WordRow{
        Reference, 2,
        "true ground expected nominal setpoint commanded wahr wahrer vorgabe nennwert vrai vraie consigne "
        "attendu attendue nominale verdadero verdadera esperado consigna vero vera atteso reale real reel"},
    WordRow{Reference, 1, "actual"},
    WordRow{Target, 3,
            "target plane wall nominal laser rail board plate ruler tape tracker interferometer encoder ziel "
            "ebene "
            "wand schiene tafel massband lineal messband cible plan mur ruban regle mire objetivo blanco "
            "pared riel "
            "cinta bersaglio parete muro righello metro rotaia"},
    WordRow{
        Target, 2,
        "distance dist abstand entfernung distanz distancia distanza eloignement stage slider position stand "
        "set commanded"},
    WordRow{
        Error, 3,
        "error err residual residuals deviation bias difference diff minus fehler abweichung differenz "
        "restfehler "
        "erreur ecart residu biais desviacion diferencia residuo sesgo errore scarto differenza deviazione"},
    WordRow{Sigma, 3,
            "sigma std stddev stdev sd noise uncertainty rauschen streuung standardabweichung stdabw "
            "unsicherheit "
            "bruit incertitude ecarttype ruido incertidumbre desvest rumore incertezza devst"},
    WordRow{Session, 5, "session sitzung seance sesion sessione"},
    WordRow{Session, 4, "run lauf messlauf passage corrida corsa"},
    WordRow{Session, 3, "series messreihe serie batch"},
    WordRow{Session, 2,
            "campaign kampagne campagne campana campagna experiment versuch essai ensayo prueba prova"},
    WordRow{Session, 1, "day tag jour dia giorno"},
    WordRow{Capture, 3, "capture aufnahme captura acquisizione cattura prise toma scatto"},
    WordRow{Capture, 2, "pose posa shot burst"},
    WordRow{Device, 3,
            "sensor device camera unit module serial geraet gerat kamera modul seriennummer capteur appareil "
            "camara "
            "dispositivo sensore telecamera modulo"},
    WordRow{Locked, 3, "locked held heldout holdout gesperrt verrouille bloqueado bloccato"},
    WordRow{Time, 3,
            "time timestamp datetime uptime elapsed clock date minutes seconds zeit zeitstempel zeitpunkt "
            "uhrzeit "
            "messzeit datum temps heure horodatage instant tiempo hora fecha instante tempo istante orario"},
    WordRow{Time, 2, "age alter dauer stamp t"},
    WordRow{Time, 1, "data ora"},
    WordRow{
        NoTime, 3,
        "exposure integration flight vol vuelo volo belichtung pose temperature frame cycle period interval"},
    WordRow{Length, 3,
            "distance range depth z dist d tiefe abstand entfernung distanz profondeur portee eloignement "
            "distancia "
            "profundidad alcance distanza profondita portata"},
    WordRow{Angle, 3,
            "angle incidence tilt theta yaw pitch roll winkel einfallswinkel neigung kippwinkel inclinaison "
            "angulo "
            "incidencia inclinacion angolo incidenza inclinazione"},
    WordRow{
        Index, 3,
        "frame index number sequence seq counter count n row bild bildnummer zeile trame image ligne cuadro "
        "fotograma fila imagen fotogramma riga numero"},
    WordRow{Pixel, 3, "pixel column col row u v x y spalte zeile colonne ligne columna fila colonna riga"},
    WordRow{Label, 1, "id name number nr no index label num nummer nom numero nombre nome"}};

struct Said {
  Meaning meaning;
  int strength;
};

const std::multimap<std::string_view, Said>& dictionary() {
  static const std::multimap<std::string_view, Said> kDictionary = [] {
    std::multimap<std::string_view, Said> all;
    for (const WordRow& row : kWords) {
      for (std::size_t begin = 0; begin < row.words.size();) {
        const std::size_t end = std::min(row.words.find(' ', begin), row.words.size());
        all.emplace(row.words.substr(begin, end - begin), Said{row.meaning, row.strength});
        begin = end + 1;
      }
    }
    return all;
  }();
  return kDictionary;
}

int strengthIn(const std::vector<std::string>& words, Meaning meaning) {
  int strength = 0;
  for (const std::string& word : words) {
    if (word.size() == 1 && words.size() > 1) continue;
    const auto [begin, end] = dictionary().equal_range(word);
    for (auto one = begin; one != end; ++one)
      if (one->second.meaning == meaning) strength = std::max(strength, one->second.strength);
  }
  return strength;
}

/// "standard deviation", "écart type", "desviación estándar": a scatter, no error.
bool saysStandard(const std::vector<std::string>& words) {
  constexpr std::array<std::string_view, 5> kStandard{"standard", "type", "estandar", "tipica", "tipo"};
  return strengthIn(words, Meaning::Error) > 0 && std::ranges::any_of(words, [&](const std::string& word) {
           return std::ranges::find(kStandard, word) != kStandard.end();
         });
}

}  // namespace

std::vector<std::string> wordsOf(std::string_view header) {
  std::string parted;
  for (std::size_t i = 0; i < header.size(); ++i) {
    const auto c = static_cast<unsigned char>(header[i]);
    const bool is_hump = i > 0 && std::isupper(c) && std::islower(static_cast<unsigned char>(header[i - 1]));
    if (is_hump) parted += ' ';
    parted += std::isalpha(c) || c >= 0x80 ? header[i] : ' ';
  }
  const std::string small = folded(parted);
  std::vector<std::string> words(1);
  for (const char c : small) {
    if (c != ' ') {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  if (words.back().empty()) words.pop_back();
  return words;
}

int strengthOf(std::string_view header, Meaning meaning) {
  const auto words = wordsOf(header);
  if (meaning == Meaning::Sigma && saysStandard(words)) return 3;
  if (meaning == Meaning::Error && saysStandard(words)) return 0;
  return strengthIn(words, meaning);
}

bool saysOnly(std::string_view header, Meaning meaning) {
  return says(header, meaning) && std::ranges::all_of(wordsOf(header), [&](const std::string& word) {
           return strengthIn({word}, meaning) > 0 || strengthIn({word}, Meaning::Label) > 0;
         });
}

bool hasWord(std::string_view header, std::initializer_list<std::string_view> words) {
  return std::ranges::any_of(wordsOf(header), [&](const std::string& word) {
    return std::ranges::find(words, word) != words.end();
  });
}

}  // namespace toftwin::table
