"use strict";
const make = (tag, text, parent) => {
  const element = document.createElement(tag);
  element.textContent = text;
  parent?.append(element);
  return element;
};
