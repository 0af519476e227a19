//! Names that people use for species besides those of the species files.

/// Names in American and British English, German, French and Spanish, by the species file's name without `.ron`. Some
/// crops have the EPPO codes of varieties too.
pub(super) const ALIASES: [(&str, &[&str]); 45] = [
    (
        "alopecurus",
        &["blackgrass", "slender meadow foxtail", "Acker-Fuchsschwanz", "vulpin des champs", "cola de zorra"],
    ),
    (
        "amaranthus",
        &["pigweed", "common amaranth", "Zurückgebogener Amarant", "Amarant", "amarante réfléchie", "bledo"],
    ),
    ("barley", &["Gerste", "Sommergerste", "orge", "cebada"]),
    (
        "bean",
        &[
            "French bean",
            "green bean",
            "kidney bean",
            "dry bean",
            "bush bean",
            "Buschbohne",
            "Gartenbohne",
            "haricot",
            "judía",
            "frijol",
        ],
    ),
    ("cabbage", &["cabbage", "Weißkohl", "Kopfkohl", "Weißkraut", "chou cabus", "chou pommé", "repollo"]),
    ("capsella", &["Hirtentäschel", "Hirtentäschelkraut", "bourse-à-pasteur", "bolsa de pastor"]),
    ("carrot", &["Möhre", "Karotte", "carotte", "zanahoria", "DAUCS"]),
    ("cauliflower", &["Blumenkohl", "Karfiol", "chou-fleur", "coliflor"]),
    (
        "chenopodium",
        &["lambsquarters", "lamb's quarters", "goosefoot", "Gänsefuß", "Weißer Gänsefuß", "chénopode blanc", "cenizo"],
    ),
    (
        "cirsium",
        &["Canada thistle", "field thistle", "Acker-Kratzdistel", "Ackerkratzdistel", "chardon des champs", "cardo"],
    ),
    ("convolvulus", &["Ackerwinde", "Acker-Winde", "liseron des champs", "correhuela"]),
    ("cyperus", &["nutsedge", "yellow nutgrass", "Erdmandelgras", "Erdmandel", "souchet comestible", "chufa"]),
    (
        "digitaria",
        &[
            "crabgrass",
            "hairy crabgrass",
            "hairy finger-grass",
            "Bluthirse",
            "Blutrote Fingerhirse",
            "digitaire sanguine",
            "garranchuelo",
        ],
    ),
    ("echinochloa", &["barnyardgrass", "cockspur", "Hühnerhirse", "panic pied-de-coq", "panic", "pata de gallo"]),
    ("fallopia", &["wild buckwheat", "climbing buckwheat", "Windenknöterich", "renouée liseron", "polígono trepador"]),
    (
        "galinsoga",
        &[
            "smallflower galinsoga",
            "quickweed",
            "Kleinblütiges Franzosenkraut",
            "Franzosenkraut",
            "galinsoga à petites fleurs",
            "soldado galante",
        ],
    ),
    (
        "galium",
        &[
            "catchweed bedstraw",
            "goosegrass",
            "Klettenlabkraut",
            "Kletten-Labkraut",
            "gaillet gratteron",
            "amor de hortelano",
        ],
    ),
    ("lettuce", &["Salat", "Kopfsalat", "laitue", "lechuga"]),
    ("maize", &["corn", "sweet corn", "Mais", "maïs", "maíz"]),
    ("onion", &["Zwiebel", "Speisezwiebel", "oignon", "cebolla"]),
    ("papaver", &["corn poppy", "field poppy", "Klatschmohn", "coquelicot", "amapola"]),
    ("pea", &["garden pea", "field pea", "Erbse", "pois", "guisante", "arveja"]),
    ("peanut", &["groundnut", "Erdnuss", "arachide", "cacahuète", "cacahuete", "maní"]),
    (
        "persicaria",
        &["ladysthumb", "lady's thumb", "Floh-Knöterich", "Flohknöterich", "renouée persicaire", "persicaria común"],
    ),
    ("plantago", &["buckhorn plantain", "ribwort", "Spitzwegerich", "plantain lancéolé", "llantén menor"]),
    ("poa", &["annual bluegrass", "Einjähriges Rispengras", "pâturin annuel", "poa anual"]),
    ("portulaca", &["purslane", "Portulak", "Gemüse-Portulak", "pourpier", "pourpier maraîcher", "verdolaga"]),
    ("potato", &["Kartoffel", "Erdapfel", "pomme de terre", "patata", "papa"]),
    ("rape", &["canola", "oilseed rape", "rapeseed", "Raps", "Winterraps", "colza", "BRSNN"]),
    ("rice", &["Reis", "riz", "arroz"]),
    ("senecio", &["common groundsel", "Gemeines Greiskraut", "Kreuzkraut", "séneçon commun", "hierba cana"]),
    (
        "setaria",
        &[
            "green bristle-grass",
            "green bristlegrass",
            "Grüne Borstenhirse",
            "Borstenhirse",
            "sétaire verte",
            "almorejo",
        ],
    ),
    (
        "sinapis",
        &["wild mustard", "field mustard", "Ackersenf", "Acker-Senf", "moutarde des champs", "mostaza silvestre"],
    ),
    ("solanum", &["nightshade", "Schwarzer Nachtschatten", "morelle noire", "hierba mora"]),
    (
        "sonchus",
        &[
            "smooth sow-thistle",
            "sow-thistle",
            "common sowthistle",
            "Kohl-Gänsedistel",
            "Gänsedistel",
            "laiteron maraîcher",
            "cerraja",
        ],
    ),
    ("soybean", &["soya bean", "soya", "soy", "Sojabohne", "Soja", "soja"]),
    ("spinach", &["Spinat", "épinard", "espinaca"]),
    ("stellaria", &["common chickweed", "Vogelmiere", "mouron des oiseaux", "stellaire intermédiaire", "pamplina"]),
    ("sugar_beet", &["sugarbeet", "beet", "Zuckerrübe", "Rübe", "betterave", "betterave sucrière", "remolacha"]),
    ("sunflower", &["Sonnenblume", "tournesol", "girasol"]),
    ("tomato", &["Tomate", "Paradeiser"]),
    (
        "tripleurospermum",
        &["false mayweed", "scentless chamomile", "Geruchlose Kamille", "matricaire inodore", "manzanilla inodora"],
    ),
    ("urtica", &["burning nettle", "dwarf nettle", "Kleine Brennnessel", "ortie brûlante", "ortiga menor"]),
    ("viola", &["field violet", "Acker-Stiefmütterchen", "Ackerstiefmütterchen", "pensée des champs", "pensamiento"]),
    ("wheat", &["common wheat", "Weizen", "Winterweizen", "blé", "blé tendre", "trigo", "TRZAW"]),
];

/// Returns the further names of a species, by the name of its file.
pub(super) fn of(stem: &str) -> &'static [&'static str] {
    ALIASES.iter().find(|(own, _)| *own == stem).map_or(&[], |(_, names)| *names)
}

/// Returns `true` if both names are the same but for case, spaces, hyphens, apostrophes and accents.
pub(super) fn same(a: &str, b: &str) -> bool {
    folded(a) == folded(b)
}

/// Returns a name in small letters, without accents and signs; umlauts as two letters, as in `Zuckerruebe`.
fn folded(name: &str) -> String {
    let letter = |c: char| match c {
        'ä' => "ae",
        'ö' => "oe",
        'ü' => "ue",
        'ß' => "ss",
        'á' | 'à' | 'â' => "a",
        'é' | 'è' | 'ê' => "e",
        'í' | 'ï' | 'î' => "i",
        'ó' | 'ô' => "o",
        'ú' | 'û' => "u",
        'ñ' => "n",
        'ç' => "c",
        _ => "",
    };
    let mut all = String::new();
    for c in name.chars().flat_map(char::to_lowercase) {
        match letter(c) {
            "" if c.is_alphanumeric() => all.push(c),
            letters => all.push_str(letters),
        }
    }
    all
}
