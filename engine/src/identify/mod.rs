//! Identification: from data to a model.
